// The renderer's kernels: rays, steps of a path, gates, differentials, and one camera path of every pass.
// Argument `large`: 0 the reference box, 1 the same with a ball of 70 000 triangles.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "core/base/parallel.h"
#include "core/films/sinks.h"
#include "core/render/renderer.h"
#include "tests/benchmark/rays.h"
#include "tests/benchmark/scenes.h"

namespace isochron::benchmarks {
namespace {

Scene scene_of(const benchmark::State& state) {
  return state.range(0) ? large_scene() : small_scene();
}

/// Kinds of rays that a rendering traces.
enum class Kind { intersect, occluded };

std::vector<RecordedRay> rays_of(const PreparedScene& prepared, Kind kind) {
  auto rays = record_rays(prepared, wide_gates(), 8, 4);
  std::erase_if(rays, [kind](const RecordedRay& r) { return r.occlusion() != (kind == Kind::occluded); });
  return rays;
}

void rays_per_second(benchmark::State& state, std::size_t rays) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays));
}

void BM_Embree(benchmark::State& state, Kind kind) {
  const Scene scene = scene_of(state);
  const PreparedScene prepared(scene, nullptr);
  const auto rays = rays_of(prepared, kind);
  for (auto _ : state) benchmark::DoNotOptimize(trace_bare(prepared.caster.embree_scene(), rays));
  rays_per_second(state, rays.size());
}
BENCHMARK_CAPTURE(BM_Embree, intersect, Kind::intersect)->ArgName("large")->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(BM_Embree, occluded, Kind::occluded)->ArgName("large")->Arg(0)->Arg(1);

void BM_RayCaster(benchmark::State& state, Kind kind) {
  const Scene scene = scene_of(state);
  const PreparedScene prepared(scene, nullptr);
  struct Ray {
    Vec3 origin, direction;
  };
  std::vector<Ray> rays;
  for (const RecordedRay& r : rays_of(prepared, kind))
    rays.push_back({{r.origin[0], r.origin[1], r.origin[2]}, {r.direction[0], r.direction[1], r.direction[2]}});
  for (auto _ : state) {
    int hits = 0;
    for (const Ray& r : rays)
      hits += kind == Kind::occluded ? prepared.caster.occluded(r.origin, r.origin + r.direction)
                                     : prepared.caster.closest_hit(r.origin, r.direction) >= 0;
    benchmark::DoNotOptimize(hits);
  }
  rays_per_second(state, rays.size());
}
BENCHMARK_CAPTURE(BM_RayCaster, intersect, Kind::intersect)->ArgName("large")->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(BM_RayCaster, occluded, Kind::occluded)->ArgName("large")->Arg(0)->Arg(1);

/// Point seen by every pixel's centre; leaves out pixels that see nothing.
std::vector<SurfacePoint> first_points(const PreparedScene& prepared) {
  std::vector<SurfacePoint> points;
  for (int pixel = 0; pixel < prepared.camera.pixels(); ++pixel) {
    const Vec3 w = prepared.camera.direction(pixel % prepared.camera.width + 0.5, pixel / prepared.camera.width + 0.5);
    if (const auto hit = prepared.end_point(prepared.closest_camera_hit(w), prepared.camera.position, w))
      points.push_back(*hit);
  }
  return points;
}

/// One bounce: next-event estimation, a scattered direction and the point it leads to.
void BM_PathStep(benchmark::State& state) {
  const Scene scene = scene_of(state);
  const PreparedScene prepared(scene, nullptr);
  const auto points = first_points(prepared);
  struct Visitor {
    double& sum;
    bool wants() const { return true; }
    void take(const Rgb& value) const { sum += value.r; }
  };
  const GateSet gates(GateShape::steady(), {0.0});
  const GatePick every_gate(gates);
  const EstimatorOptions options{.max_bounces = 1};
  NoSink sink;
  Worker worker(prepared, gates, options, every_gate, sink);
  Path path(1);
  SurfacePoint eye;
  eye.p = prepared.camera.position;
  double sum = 0;
  const Rng base(Stream{.seed = 1}, 0, 0);
  std::uint32_t sample = 0;
  for (auto _ : state) {
    Rng rng = base.with_sample(sample);
    path.start(eye, 0);
    path.push(prepared, points[sample++ % points.size()]);
    walk_standard(worker, path, 0, 1, {0, 1e30}, rng, Visitor{sum});
  }
  benchmark::DoNotOptimize(sum);
}
BENCHMARK(BM_PathStep)->ArgName("large")->Arg(0)->Arg(1);

/// A path over four vertices: camera, two scattering points, emitter. All of the block or ball moves.
class FourVertices {
 public:
  explicit FourVertices(const Scene& scene) : basis_(all_vertices(scene)), prepared(scene, &basis_) {
    eye_.p = prepared.camera.position;
    const auto points = first_points(prepared);
    Rng rng(Stream{.seed = 2}, 0, 0);
    for (const SurfacePoint& x : points) {
      double pdf;
      const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
      const SurfacePoint y = prepared.sample_emitter(u0, u1, u2, pdf);
      const auto& between = points[static_cast<std::size_t>(rng.uniform() * static_cast<double>(points.size()))];
      if (prepared.has_moving_vertex(x.triangle) || prepared.has_moving_vertex(between.triangle))
        paths.push_back({eye_, x, between, y});
    }
  }

 private:
  TangentBasis basis_;
  SurfacePoint eye_;

 public:
  PreparedScene prepared;
  std::vector<std::array<SurfacePoint, 4>> paths;
};

void BM_PathDifferential(benchmark::State& state) {
  const Scene scene = scene_of(state);
  const FourVertices four(scene);
  LocalDifferential differential;
  std::size_t i = 0;
  for (auto _ : state) {
    differentiate_path(four.prepared, 0, four.paths[i].data(), 4, false, differential);
    benchmark::DoNotOptimize(differential.vertices.data());
    i = (i + 1) % four.paths.size();
  }
}
BENCHMARK(BM_PathDifferential)->ArgName("large")->Arg(0)->Arg(1);

void BM_AdjointScatter(benchmark::State& state) {
  const Scene scene = scene_of(state);
  const FourVertices four(scene);
  const GateSet gates = wide_gates();
  std::vector<LocalDifferential> differentials(four.paths.size());
  for (std::size_t i = 0; i < four.paths.size(); ++i)
    differentiate_path(four.prepared, 0, four.paths[i].data(), 4, false, differentials[i]);
  const TangentBasis basis = all_vertices(scene);
  std::vector<GatedImage> adjoints(state.range(1),
                                   GatedImage(scene.camera.width, scene.camera.height, gates.size(), 1));
  for (GatedImage& adjoint : adjoints) std::fill(adjoint.data.begin(), adjoint.data.end(), 1.0);
  const std::size_t sums = adjoints.size() * static_cast<std::size_t>(four.prepared.layout.size());
  SparseSum gradient(sums);
  AdjointSink sink(gates, four.prepared.layout, basis, adjoints, gradient);
  std::size_t i = 0;
  for (auto _ : state) {
    sink.bind(differentials[i]);
    sink.add(static_cast<int>(i), Rgb(1.0), 5 + 4 * static_cast<double>(i) / static_cast<double>(four.paths.size()),
             GateUse{});
    i = (i + 1) % four.paths.size();
  }
  double sum = 0;
  gradient.for_each(0, sums, [&](std::size_t, double x) { sum += x; });
  benchmark::DoNotOptimize(sum);
}
BENCHMARK(BM_AdjointScatter)->ArgNames({"large", "adjoints"})->ArgsProduct({{0, 1}, {1, 4}});

/// Values of all gates at a random length; the argument is their number.
void BM_Gates(benchmark::State& state) {
  std::vector<double> centers;
  for (int g = 0; g < state.range(0); ++g) centers.push_back(5 + 5.0 * g / static_cast<double>(state.range(0)));
  const GateSet gates(GateShape::gaussian(0.25 / static_cast<double>(state.range(0))), centers);
  Rng rng(Stream{.seed = 1}, 0, 0);
  std::vector<double> lengths(4096);
  for (double& l : lengths) l = 4.5 + 6 * rng.uniform();
  double sum = 0;
  std::size_t i = 0;
  for (auto _ : state) {
    gates.for_each_value(lengths[i], [&sum](int, double w) { sum += w; });
    i = (i + 1) % lengths.size();
  }
  benchmark::DoNotOptimize(sum);
}
BENCHMARK(BM_Gates)->ArgName("gates")->Arg(1)->Arg(10)->Arg(500);

enum class Pass { primal, interior, visibility };

/// One camera path (all its connections included) of a pass; time is per path.
void BM_CameraPath(benchmark::State& state, Pass pass, Sampling sampling) {
  const Scene scene = scene_of(state);
  const TangentBasis basis = translation(scene);
  const GateSet gates = sampling == Sampling::ellipsoidal ? narrow_gates() : wide_gates();
  const Renderer renderer(scene, gates, {.max_bounces = 3, .sampling = sampling}, &basis);
  GatedImage adjoint(scene.camera.width, scene.camera.height, gates.size(), 1);
  std::fill(adjoint.data.begin(), adjoint.data.end(), 1.0);
  std::vector<double> gradient(static_cast<std::size_t>(DofLayout(scene).size()));
  set_thread_count(1);
  int sample = 0;
  for (auto _ : state) {
    const SampleRange range{sample, sample + 1};
    ++sample;
    if (pass == Pass::primal)
      benchmark::DoNotOptimize(renderer.render({.seed = 1}, range).data.data());
    else
      renderer.add_gradient(pass == Pass::interior ? Term::interior : Term::visibility, adjoint, {.seed = 1, .pass = 1},
                            range, gradient);
  }
  set_thread_count(0);
  benchmark::DoNotOptimize(gradient.data());
  state.counters["per_path"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * scene.camera.width * scene.camera.height,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(BM_CameraPath, primal_standard, Pass::primal, Sampling::standard)->ArgName("large")->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(BM_CameraPath, primal_ellipsoidal, Pass::primal, Sampling::ellipsoidal)
    ->ArgName("large")
    ->Arg(0)
    ->Arg(1);
BENCHMARK_CAPTURE(BM_CameraPath, interior_standard, Pass::interior, Sampling::standard)
    ->ArgName("large")
    ->Arg(0)
    ->Arg(1);
BENCHMARK_CAPTURE(BM_CameraPath, interior_ellipsoidal, Pass::interior, Sampling::ellipsoidal)
    ->ArgName("large")
    ->Arg(0)
    ->Arg(1);
BENCHMARK_CAPTURE(BM_CameraPath, visibility, Pass::visibility, Sampling::standard)->ArgName("large")->Arg(0)->Arg(1);

}  // namespace
}  // namespace isochron::benchmarks
