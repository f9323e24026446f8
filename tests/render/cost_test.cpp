// What a gradient costs: not more for ten thousand vertices than for one translation of them, and not much
// more for 64 gates than for one. Processor time of one thread.
#include <gtest/gtest.h>

#include <limits>
#include <numeric>

#include "core/base/cpu_time.h"
#include "core/base/parallel.h"
#include "core/films/sinks.h"
#include "core/render/passes.h"
#include "core/techniques/secondary_boundary.h"
#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

template <class F>
double seconds(F&& f) {
  const double start = cpu_seconds();
  f();
  return cpu_seconds() - start;
}

/// Expects time(a) <= bound * time(b). Each is timed several times, in turns, and its least time counts: what else
/// the machine does can only add to it, while a real excess stays however often one looks.
template <class A, class B>
void expect_cost_ratio_below(double bound, const std::string& what, A&& a, B&& b) {
  constexpr int kPairs = 5, kMostPairs = 30;
  double least_a = std::numeric_limits<double>::infinity(), least_b = least_a;
  a();
  b();
  for (int pair = 0; pair < kPairs || (least_a > bound * least_b && pair < kMostPairs); ++pair) {
    least_a = std::min(least_a, seconds(a));
    least_b = std::min(least_b, seconds(b));
  }
  ::testing::Test::RecordProperty(what, std::to_string(least_a / least_b));
  EXPECT_LE(least_a, bound * least_b) << what;
}

/// A bumpy field of 100 x 100 vertices under a square lamp.
Scene bumpy_scene() {
  Scene scene;
  scene.camera.position = {0.2, 2.5, 2.0};
  scene.camera.look_at = {0, 0, 0};
  scene.camera.width = scene.camera.height = 16;
  const auto height = [](double x, double z) { return 0.08 * std::sin(9 * x) * std::cos(7 * z + x); };
  add_shape(scene, "field", height_field(100, 100, -1, 1, height), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({-0.4, 1.6, -0.9}, {0.4, 1.6, -0.9}, {0.4, 1.6, -0.2}, {-0.4, 1.6, -0.2}),
            diffuse(Rgb(0.0)), Rgb(10.0));
  return scene;
}

class Cost : public ::testing::TestWithParam<Sampling> {
 protected:
  Cost() { set_thread_count(1); }
  ~Cost() override { set_thread_count(0); }
  /// Ellipses cross hundreds of triangles of the field: fewer samples take as long. Enough of them, in
  /// any case, that clearing and merging the partitions' gradients (about 3 ms a pass here, more where memory is
  /// slow) is a small share.
  static int samples(Term term) {
    const bool ellipses = term == Term::path_length || (term == Term::interior && GetParam() == Sampling::ellipsoidal);
    return ellipses ? 8 : term == Term::interior ? 512 : 64;
  }
  static std::string sampling() { return GetParam() == Sampling::standard ? "standard" : "ellipsoidal"; }
};

TEST_P(Cost, IndependentOfTheNumberOfParameters) {
  const Scene scene = bumpy_scene();
  const TangentBasis translation = make_basis(scene, {translate(scene, "field", {0.3, 1, 0.2})});
  const Shape& field = scene.shapes[0];
  ASSERT_EQ(field.vertex_count, 10000);
  std::vector<int> dofs(3 * field.vertex_count);
  std::iota(dofs.begin(), dofs.end(), 3 * field.first_vertex);
  const TangentBasis free = free_dofs(scene, dofs);
  ASSERT_EQ(free.columns, 30000);

  const GateSet gates(GateShape::truncated_gaussian(0.1, 0.25), {4.5, 4.8});
  const EstimatorOptions options{.max_bounces = 2, .sampling = GetParam()};
  const Renderer one(scene, gates, options, &translation), many(scene, gates, options, &free);
  GatedImage adjoint = one.render({1, 0, 0}, {0, 1});
  for (std::size_t i = 0; i < adjoint.data.size(); ++i) adjoint.data[i] = std::sin(1.0 + static_cast<double>(i));
  std::vector<double> of_one(DofLayout(scene).size(), 0.0), of_many(of_one);
  for (const Term term : kTerms) {
    const auto gradient = [&](const Renderer& renderer, const TangentBasis& basis, std::vector<double>& sum) {
      std::fill(sum.begin(), sum.end(), 0.0);
      renderer.add_gradient(term, adjoint, {1, 0, 1}, {0, samples(term)}, sum);
      return basis.transpose_apply(sum);
    };
    expect_cost_ratio_below(
        1.3, sampling() + ", " + name(term), [&] { gradient(many, free, of_many); },
        [&] { gradient(one, translation, of_one); });
    // Against forward differentiation by one parameter, which knows of no other: both gradients above go
    // through all degrees of freedom of the field.
    expect_cost_ratio_below(
        1.3, sampling() + ", against one tangent, " + name(term), [&] { gradient(many, free, of_many); },
        [&] {
          one.derive(term, {1, 0, 1}, {0, samples(term)});
        });
    // The same samples were taken, so the time was spent on the same work.
    const double single = translation.transpose_apply(of_one)[0], from_all = translation.transpose_apply(of_many)[0];
    EXPECT_NE(single, 0);
    EXPECT_NEAR(from_all, single, 1e-9 * std::abs(single));
  }
}

TEST_P(Cost, NearlyIndependentOfTheNumberOfGates) {
  const Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  const TangentBasis basis = make_basis(scene, {translate(scene, "block", {0.3, 1, 0.2})});
  std::vector<double> centers;
  for (int g = 0; g < 64; ++g) centers.push_back(5.3 + 0.005 * g);
  const GateSet one_gate(GateShape::gaussian(0.3), {5.46}), many_gates(GateShape::gaussian(0.3), centers);
  const EstimatorOptions options{.max_bounces = 3, .sampling = GetParam()};
  const Renderer one(scene, one_gate, options, &basis), many(scene, many_gates, options, &basis);
  GatedImage like_one = one.render({1, 0, 0}, {0, 1}), like_many = many.render({1, 0, 0}, {0, 1});
  for (GatedImage* adjoint : {&like_one, &like_many})
    for (std::size_t i = 0; i < adjoint->data.size(); ++i) adjoint->data[i] = std::sin(1.0 + static_cast<double>(i));
  std::vector<double> sum(DofLayout(scene).size(), 0.0);
  const SampleRange range{0, GetParam() == Sampling::standard ? 64 : 16};
  expect_cost_ratio_below(
      1.5, sampling() + ", 64 gates, primal",
      [&] {
        many.render({1, 0, 0}, range);
      },
      [&] {
        one.render({1, 0, 0}, range);
      });
  for (const Term term : {Term::interior, Term::visibility})
    expect_cost_ratio_below(
        1.5, sampling() + ", 64 gates, " + name(term),
        [&] {
          many.add_gradient(term, like_many, {1, 0, 1}, range, sum);
        },
        [&] {
          one.add_gradient(term, like_one, {1, 0, 1}, range, sum);
        });
}

INSTANTIATE_TEST_SUITE_P(, Cost, ::testing::Values(Sampling::standard, Sampling::ellipsoidal), [](const auto& test) {
  return std::string(test.param == Sampling::standard ? "Standard" : "Ellipsoidal");
});

/// A small plate moves among others, a floor and a lamp that stand. Half of the searches go to edges that stand, as those that
/// move and those that do not get equal shares; few of their segments meet the plate, and those that do not cast no rays. Rays
/// of a search: 1.13 from the edge, 0.29 from the camera, but 1.85 and 0.42 if each segment casts its rays.
TEST(BoundaryCost, SegmentsThatMeetNothingMovingCastNoRays) {
  Scene scene;
  scene.camera = {{0, 6, 14}, {0, 0, 0}, {0, 1, 0}, 50, 16, 16};
  for (int i = 0; i < 8; ++i) {
    const double x = i - 3.5;
    add_shape(scene, "plate" + std::to_string(i),
              quad({x - 0.3, 0, -0.3}, {x - 0.3, 0, 0.3}, {x + 0.3, 0, 0.3}, {x + 0.3, 0, -0.3}),
              diffuse(Rgb(0.6), true));
  }
  add_shape(scene, "floor", quad({-9, -2, -9}, {-9, -2, 9}, {9, -2, 9}, {9, -2, -9}), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({-1, 4, -1}, {1, 4, -1}, {1, 4, 1}, {-1, 4, 1}), diffuse(Rgb(0.0)), Rgb(10.0));
  const GateSet gates(GateShape::steady(), {0.0});
  const EstimatorOptions options{.max_bounces = 1};
  const BoundaryGuide unguided({true, true, true, false, true});
  const GatePick every_gate(gates);
  const TangentBasis basis = make_basis(scene, {translate(scene, "plate0", {0, 1, 0})});
  const auto rays = [&](bool from_camera) {
    const PreparedScene prepared(scene, &basis);
    const BoundaryEdges edges(prepared);
    GuideSink sink(gates, prepared.layout, basis);
    Worker worker(prepared, gates, options, every_gate, sink);
    SecondaryBoundary boundary(worker, edges, unguided, false);
    constexpr int kSearches = 4096;
    for (int i = 0; i < kSearches; ++i) {
      Rng rng(Stream{9, 0, 0}, i, 0);
      if (from_camera)
        boundary.sample_from_camera(i % prepared.camera.pixels(), 1, rng);
      else
        boundary.sample_from_edge(0, 1, rng);
    }
    return static_cast<double>(worker.counts.rays) / kSearches - from_camera;  // but for the camera's own
  };
  EXPECT_LT(rays(false), 1.4);
  EXPECT_LT(rays(true), 0.35);
}

struct SegmentSink final : Sink {
  bool differential() const override { return true; }
  void note_path(const Path& path) override { segments += path.size() - 1; }
  void add(int, const Rgb&, double, GateUse) override {}
  long long segments = 0;
};

/// In images by standard sampling work is rays alone; derivatives differentiate the paths that they find.
TEST(Work, CountsDifferentiatedSegments) {
  const Scene scene = bumpy_scene();
  const GateSet gates(GateShape::gaussian(0.5), {4.0});
  const TangentBasis basis = make_basis(scene, {translate(scene, "lamp", {0, 1, 0})});
  const Passes passes(scene, gates, {.max_bounces = 3, .sampling = Sampling::standard}, &basis, nullptr);
  const Stream stream{1, 2, 3};
  const Pass pass{stream, {0, 2}};
  SegmentSink sink;
  passes.run_term(Term::interior, pass, {0, 1}, passes.every_gate, sink);
  EXPECT_GT(sink.segments, 100);
  EXPECT_DOUBLE_EQ(passes.work(),
                   static_cast<double>(passes.rays()) + kRaysPerSegment * static_cast<double>(sink.segments));
}

}  // namespace
}  // namespace isochron::testing
