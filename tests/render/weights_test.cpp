// Multiple importance sampling, path by path: the parts of a path that all techniques take which could have found it add up to
// one, and what a technique hands on is the path's contribution over its density, times that part. Nothing is estimated:
// sums hold to round-off for every path, so that a density that two techniques see otherwise fails at once.
#include <gtest/gtest.h>

#include "core/techniques/ellipsoidal.h"
#include "core/techniques/light_subpaths.h"
#include "core/techniques/standard_paths.h"
#include "support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// Keeps complete paths, with the pixel and the value that came with each.
struct PathSink final : Sink {
  struct Found {
    Path path;
    int pixel;
    Rgb value;
  };
  std::vector<Found> found;
  bool differential() const override { return false; }
  void note_path(const Path& path) override { found.push_back({path, -1, {}}); }
  void add(int pixel, const Rgb& value, double, GateUse) override {
    found.back().pixel = pixel;
    found.back().value = value;
  }
};

/// Every pixel and gate counts, each otherwise.
GatedImage positive_adjoint(const Scene& scene, int gates) {
  GatedImage adjoint(scene.camera.width, scene.camera.height, gates, 1);
  Rng rng(Stream{test_seed(5), 0, 0}, 0, 0);
  for (double& x : adjoint.data) x = 0.01 + rng.uniform() * rng.uniform();
  return adjoint;
}

/// What finds paths under one pair of options, and the paths that it found.
struct Finder {
  Scene scene;
  PreparedScene prepared;
  GateSet gates{GateShape::gaussian(0.6), {4.5, 5.0, 6.0}};  // they overlap
  EstimatorOptions options{.max_bounces = 2, .pick = ArcPick::uniform};
  GatePick pick;
  PathSink sink;
  Worker worker;

  explicit Finder(const Material& block)
      : scene(glossy_validation_scene(8, 0.4, block)),
        prepared(scene, nullptr),
        pick(gates, std::vector{positive_adjoint(scene, 3)}, true, 1),
        worker(prepared, gates, options, pick, sink) {}

  void find_by_standard_sampling(int paths) {
    StandardPaths standard(worker);
    for (int i = 0; i < paths; ++i) {
      Rng rng(Stream{test_seed(1), 0, 0}, i, 0);
      standard.start(i % prepared.pixels(), 1, rng);
    }
    standard.finish();
  }
  template <class F>
  void find_by_connections(int samples, F&& sample) {
    GatePass single_lengths;
    single_lengths.value = true;
    EllipsoidalConnections connections(worker, single_lengths);
    for (int i = 0; i < samples; ++i) {
      Rng rng(Stream{test_seed(2), 0, 0}, i, 0);
      sample(connections, i % prepared.pixels(), rng);
    }
  }
};

/// Density of the path's vertex number `on_arc` on its arc, per area and length, as a connection would draw it; 0: it would not.
double pdf_on_arc(const PreparedScene& scene, const Path& path, int on_arc) {
  const bool by_emitter = on_arc == path.size() - 1;
  if (on_arc < 1) return 0;
  const SurfacePoint &from = path.vertex[on_arc - 1], &found = path.vertex[on_arc];
  const SurfacePoint& other = by_emitter ? from : path.vertex[on_arc + 1];
  const double r = length(found.p - from.p), s = by_emitter ? r : length(found.p - other.p);
  const Ellipsoid ellipsoid(from.p, other.p, r + s);
  EllipseArcs arcs;
  if (!ellipsoid.valid() || !scene.clip(ellipsoid, found.triangle, arcs)) return 0;
  const double by_angle = by_emitter ? r : area_per_angle_and_length(ellipsoid, found.p, found.n);
  return 1 / (arcs.total_span * by_angle);
}

/// What connections take of the path.
double part_of_connections(const Finder& f, const PathSink::Found& found, TargetLength target) {
  target.tau[0] = found.path.length.back();
  double sum = 0;
  const int last = found.path.size() - 1;
  const int first = f.worker.balance.light_connections ? 1 : std::max(1, last - 1);
  for (int on_arc = first; on_arc <= last; ++on_arc)
    if (const double pdf = pdf_on_arc(f.prepared, found.path, on_arc); pdf > 0)
      sum += f.worker.balance.connection(found.path, found.pixel, target, 0, on_arc, pdf);
  return sum;
}

TargetLength pair_target(int gate) {
  TargetLength target;
  target.pair = true;
  target.gate = gate;
  return target;
}

class Weights : public ::testing::TestWithParam<const char*> {
 protected:
  Finder finder() const { return Finder(std::string(GetParam()) == "glass" ? glass(0.3, 1.5) : diffuse(Rgb(0.6))); }
};

TEST_P(Weights, AddUpToOne) {
  Finder f = finder();
  f.find_by_standard_sampling(4000);
  f.find_by_connections(2000, [](auto& connections, int pixel, Rng& rng) {
    connections.sample_walk(pixel, 1, rng);
    connections.sample_from_camera(1, rng);
  });
  ASSERT_GT(f.sink.found.size(), 1000u);
  int shared_by_light = 0, found_by_arcs = 0;
  for (const PathSink::Found& found : f.sink.found) {
    // Of standard sampling and light subpaths, by every joint.
    for (const double light : {0.0, 0.25, 3.0}) {
      f.worker.balance.light_rate = light;
      double of_light = 0;
      for (int joint = 0; joint <= found.path.size() - 3; ++joint)
        of_light += f.worker.balance.light(found.path, found.pixel, joint);
      EXPECT_NEAR(f.worker.balance.standard(found.path, found.pixel) + of_light, 1, 1e-9);
      shared_by_light += of_light > 0.01 && of_light < 0.99;
    }
    if (!f.prepared.outside(found.path.vertex[found.path.size() - 2], found.path.back())) continue;
    for (const bool light : {false, true}) {
      f.worker.balance.light_connections = light;
      for (const TargetLength& target : {TargetLength{}, pair_target(0), pair_target(1), pair_target(2)})
        EXPECT_NEAR(part_of_connections(f, found, target), 1, 1e-9);
    }
    f.worker.balance.light_connections = false;
    ++found_by_arcs;
  }
  EXPECT_GT(shared_by_light, 500);
  EXPECT_GT(found_by_arcs, 500);
}

/// Of the two ways to end a path on an emitter's border.
TEST_P(Weights, OfBordersAddUpToOne) {
  Finder f = finder();
  f.find_by_standard_sampling(4000);
  int shared = 0;
  for (const PathSink::Found& found : f.sink.found) {
    const int last = found.path.size() - 1;
    const double pdf = pdf_on_arc(f.prepared, found.path, last - 1);
    if (last < 2 || !(pdf > 0) || !f.prepared.outside(found.path.vertex[last - 2], found.path.vertex[last - 1]))
      continue;
    const Vec3 tangent = normalize(f.prepared.edges(found.path.back().triangle)[0]);
    const auto part = [&](std::optional<double> pdf_of_arc) {
      return f.worker.balance.border(found.path, found.pixel, found.path.length.back(), tangent, 0.7, pdf_of_arc);
    };
    EXPECT_NEAR(part(pdf) + part({}), 1, 1e-9);
    shared += part(pdf) > 0.01 && part({}) > 0.01;
  }
  EXPECT_GT(shared, 500);
}

/// Of two bounces' paths, surface arcs come from the camera and serve the whole image, emitter arcs serve a pixel: what each
/// takes is in proportion to how often it makes the path. A pair serves one gate, a single length all of them.
TEST_P(Weights, OfArcsAreInProportionToTheirDensities) {
  Finder f = finder();
  f.find_by_standard_sampling(4000);
  int compared = 0;
  for (const auto& [path, pixel, value] : f.sink.found) {
    if (path.size() != 3) continue;
    const double surface = pdf_on_arc(f.prepared, path, 1), emitter = pdf_on_arc(f.prepared, path, 2);
    if (!(surface > 0 && emitter > 0)) continue;
    const SurfacePoint &q = path.vertex[1], &y = path.vertex[2];
    if (!f.prepared.outside(q, y)) continue;
    const Vec3 w = normalize(q.p - path.vertex[0].p);
    const double walk = f.prepared.camera.image_area_per_solid_angle(w) * solid_angle_to_area(path.vertex[0].p, q) /
                        f.prepared.pixels() * f.pick.rate(pixel);
    const auto expect_ratio = [&](TargetLength target, double of_image, double of_pixel) {
      target.tau[0] = path.length.back();
      const double by_surface = f.worker.balance.connection(path, pixel, target, 0, 1, surface),
                   by_emitter = f.worker.balance.connection(path, pixel, target, 0, 2, emitter);
      const double expected = f.prepared.emitter_pdf(y.triangle) * surface * of_image / (walk * emitter * of_pixel);
      EXPECT_NEAR(by_surface / by_emitter, expected, 1e-9 * expected);
    };
    for (int gate = 0; gate < 3; ++gate)
      expect_ratio(pair_target(gate), f.pick.probability(GatePick::kImage, gate), f.pick.probability(pixel, gate));
    const double length = path.length.back();
    expect_ratio({}, f.pick.length_pdf(GatePick::kImage, length), f.pick.length_pdf(pixel, length));
    ++compared;
  }
  EXPECT_GT(compared, 300);
}

/// What the camera's own connections and those at x1 hand on. One arc of all triangles that hold one is picked uniformly.
TEST_P(Weights, AreThoseOfWhatConnectionsHandOn) {
  for (const bool from_camera : {true, false}) {
    Finder f = finder();
    f.find_by_connections(4000, [&](EllipsoidalConnections& connections, int pixel, Rng& rng) {
      from_camera ? connections.sample_from_camera(1, rng) : connections.sample_walk(pixel, 1, rng);
    });
    const int on_arc = from_camera ? 1 : 2;
    int compared = 0;
    for (const auto& [path, pixel, value] : f.sink.found) {
      if (path.size() != 3) continue;
      const SurfacePoint &x = path.vertex[0], &q = path.vertex[1], &y = path.vertex[2];
      const Scattering s(x.p, q, y.p);
      Rgb expected = bsdf_value(f.prepared, q, s) * f.prepared.emitted(y, -s.w_i) *
                     (std::abs(s.cos_i) * solid_angle_to_area(q.p, y));
      double density = pdf_on_arc(f.prepared, path, on_arc) *
                       f.pick.length_pdf(from_camera ? GatePick::kImage : pixel, path.length.back());
      std::vector<int> triangles;
      if (from_camera) {
        expected *= f.prepared.importance(pixel, -s.w_o) * solid_angle_to_area(x.p, q);
        density *= f.prepared.emitter_pdf(y.triangle);
        const double tau = s.distance_o + s.distance_i;
        f.prepared.hierarchy(PreparedScene::Part::all).query_surfaces(x.p, y.p, tau, tau, triangles);
      } else {
        const double tau = 2 * s.distance_i;
        f.prepared.hierarchy(PreparedScene::Part::emitting).query_surfaces(q.p, q.p, tau, tau, triangles);
      }
      TargetLength target;
      target.tau[0] = path.length.back();
      expected *= f.worker.balance.connection(path, pixel, target, 0, on_arc, pdf_on_arc(f.prepared, path, on_arc)) *
                  static_cast<double>(triangles.size()) / density;
      EXPECT_NEAR(value.r, expected.r, 1e-6 * expected.r);
      ++compared;
    }
    EXPECT_GT(compared, 200) << from_camera;
  }
}

/// Next-event estimation and rays by the BSDF hand on the same: contribution over the sum of their densities.
TEST_P(Weights, OfNextEventsAndRaysAddUpToOne) {
  Finder f = finder();
  f.find_by_standard_sampling(4000);
  int found_of[4] = {0, 0, 0, 0};
  for (const auto& [path, pixel, value] : f.sink.found) {
    const int last = path.size() - 1;
    const SurfacePoint& y = path.back();
    Rgb expected = f.prepared.emitted(y, normalize(path.vertex[last - 1].p - y.p));
    for (int k = 1; k < last; ++k) {
      const Scattering s(path.vertex[k - 1].p, path.vertex[k], path.vertex[k + 1].p);
      double pdf = f.prepared.bsdf_of(path.vertex[k].triangle).pdf(s);
      if (k == last - 1) pdf += f.prepared.emitter_pdf(y.triangle) / solid_angle_to_area(path.vertex[k].p, y);
      expected *= bsdf_value(f.prepared, path.vertex[k], s) * (std::abs(s.cos_i) / pdf);
    }
    EXPECT_NEAR(value.r, expected.r, 1e-6 * expected.r);
    ++found_of[last];
  }
  EXPECT_GT(found_of[2], 500);
  EXPECT_GT(found_of[3], 500);
}

/// What light subpaths hand on, by whichever joint, and standard sampling: contribution over the sum of all densities.
TEST_P(Weights, OfLightSubpathsAreOverTheSumOfAllDensities) {
  constexpr double kLight = 1.5;
  Finder f = finder();
  f.options.max_bounces = 3;
  f.worker.balance.light_rate = kLight;
  f.find_by_standard_sampling(2000);
  const std::size_t by_standard = f.sink.found.size();
  std::vector<int> from(by_standard, -1);
  LightSubpaths light(f.worker);
  for (int i = 0; i < 6000; ++i) {
    Rng rng(Stream{test_seed(4), 0, 0}, i, 0);
    light.sample(i % f.prepared.pixels(), 1, rng);
    from.resize(f.sink.found.size(), i % f.prepared.pixels());
  }
  int of_bounces[4] = {0, 0, 0, 0}, by_camera = 0;
  for (std::size_t i = 0; i < f.sink.found.size(); ++i) {
    const auto& [path, pixel, value] = f.sink.found[i];
    const int last = path.size() - 1;
    if (last < 2) continue;
    const SurfacePoint& y = path.back();
    const Vec3 w1 = normalize(path.vertex[1].p - path.vertex[0].p);
    const auto to_area = [&](int a, int b) { return solid_angle_to_area(path.vertex[a].p, path.vertex[b]); };
    // Per area, of vertex k: from the camera through a point of the pixel, and from the light.
    std::vector<double> a(last + 1), b(last + 1);
    const Vec3 to_q = normalize(path.vertex[last - 1].p - y.p);
    Rgb contribution = f.prepared.emitted(y, to_q) * (f.prepared.camera.image_area_per_solid_angle(w1) * to_area(0, 1));
    a[1] = f.prepared.camera.image_area_per_solid_angle(w1) * to_area(0, 1);
    b[last] = f.prepared.emitter_pdf(y.triangle);
    b[last - 1] = kInvPi * dot(y.n, to_q) * to_area(last, last - 1);
    for (int k = 1; k < last; ++k) {
      const SurfacePoint& x = path.vertex[k];
      const Scattering s(path.vertex[k - 1].p, x, path.vertex[k + 1].p);
      const Bsdf& bsdf = f.prepared.bsdf_of(x.triangle);
      contribution *= bsdf_value(f.prepared, x, s) * (std::abs(s.cos_i) * to_area(k, k + 1));
      a[k + 1] = bsdf.pdf(s) * to_area(k, k + 1);
      if (k > 1) b[k - 1] = bsdf.pdf(s.reversed()) * to_area(k, k - 1);
    }
    double standard = b[last] + a[last], of_light = 0, of_camera = 0;
    for (int k = 1; k < last; ++k) standard *= a[k];
    for (int joint = 0; joint < last - 1; ++joint) {
      double density = 1;
      for (int k = 1; k <= last; ++k) density *= k <= joint ? a[k] : b[k];
      // The camera's own joints serve all pixels, as many times as there are samples of any.
      (joint == 0 ? of_camera : of_light) += density;
    }
    of_camera *= f.prepared.pixels() / f.pick.rate(pixel);
    const double sum = standard + kLight * (of_light + of_camera);
    double expected = contribution.r / sum;
    const double handed_on = value.r;
    if (from[i] >= 0) {
      expected *= kLight;
      const double of_own = expected * f.pick.rate(from[i]) / f.pick.rate(pixel);
      if (std::abs(handed_on - of_own) < std::abs(handed_on - expected)) expected = of_own, ++by_camera;
      ++of_bounces[last - 1];
    }
    EXPECT_NEAR(handed_on, expected, 1e-6 * expected);
  }
  for (const int bounces : {1, 2, 3}) EXPECT_GT(of_bounces[bounces], 200) << bounces;
  EXPECT_GT(by_camera, 200);
}

INSTANTIATE_TEST_SUITE_P(Blocks, Weights, ::testing::Values("diffuse", "glass"),
                         [](const auto& test) { return test.param; });

/// Light that is gathered for a boundary segment.
TEST(GatheredWeights, AddUpToOne) {
  struct Receiver final : LengthReceiver {
    const Worker* worker = nullptr;
    int shared = 0;
    void take(int, int, const Rgb&) override {
      double sum = 0, most = 0;
      for (const int before_last : {0, 1}) {
        const int on_arc = worker->path.size() - 1 - before_last;
        if (const double pdf = pdf_on_arc(worker->scene, worker->path, on_arc); pdf > 0) {
          const double weight = worker->balance.gathered(worker->path, on_arc, pdf);
          sum += weight;
          most = std::max(most, weight);
        }
      }
      EXPECT_NEAR(sum, 1, 1e-9);
      shared += most < 0.99;
    }
  } receiver;
  Finder f(diffuse(Rgb(0.6)));
  receiver.worker = &f.worker;
  EllipsoidalConnections connections(f.worker, {}, &receiver);
  for (int i = 0; i < 20000; ++i) {
    Rng rng(Stream{test_seed(3), 0, 0}, i, 0);
    if (f.worker.start_path(i % f.prepared.pixels(), rng) == 0) continue;
    const double length = 3 + 3 * rng.uniform();
    connections.gather({&length, 1}, 2, rng);
  }
  EXPECT_GT(receiver.shared, 100);
}

}  // namespace
}  // namespace isochron::testing
