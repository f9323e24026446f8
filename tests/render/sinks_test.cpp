// The three sinks on the same samples: what the adjoint sink scatters to the degrees of freedom is, column by
// column, what the tangent sink's images amount to under the same adjoint; and a column does not depend on
// its neighbours.
#include <gtest/gtest.h>

#include <numeric>

#include "core/base/random.h"
#include "support.h"

namespace isochron::testing {
namespace {

Scene make_scene(bool grey) {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 8;
  scene.grey = grey;
  replace_material(scene, "panel", conductor(grey ? Rgb(0.7) : Rgb{0.8, 0.6, 0.3}, 0.35, true));
  if (!grey) {
    replace_material(scene, "grey", diffuse({0.5, 0.2, 0.7}));
    replace_material(scene, "block", retroreflector({0.3, 0.1, 0.4}, {0.1, 0.5, 0.3}, 0.4));
    scene.shapes[scene.find_shape("light")].emission = Rgb{15, 12, 4};
  }
  return scene;
}

/// One motion of every kind.
std::vector<Motion> all_motions(const Scene& scene) {
  const Vec3 corner = scene.positions[scene.shapes[scene.find_shape("panel")].first_vertex];
  return {translate(scene, "block", {0.3, -0.4, 0.8}),
          rotate_y(scene, "block", {-0.2, 0, 0.1}),
          translate(scene, "panel", {0.2, 1, -0.5}, [corner](const Vec3& p) { return p == corner; }),
          translate(scene, "light", {0, 0, 1}),
          change_material(scene, "grey", "albedo"),
          change_material(scene, "panel", "roughness"),
          change_emission(scene, "light")};
}

GateShape table() {
  return GateShape::tabulated({-0.4, -0.1, -0.1, 0.3, 0.5}, {0.2, 0.8, 1.4, 0.6, 0.1});
}

struct SinkSetting {
  const char* name;
  GateShape shape;
  Sampling sampling;
  bool antithetic;
};

std::vector<SinkSetting> settings() {
  std::vector<SinkSetting> all;
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    all.push_back({"gaussian", GateShape::gaussian(0.2), sampling, true});
    all.push_back({"boxcar", GateShape::boxcar(0.5), sampling, true});
    all.push_back({"truncated", GateShape::truncated_gaussian(0.2, 0.3), sampling, true});
    all.push_back({"table", table(), sampling, true});
  }
  all.push_back({"gaussian, uncoupled", GateShape::gaussian(0.2), Sampling::ellipsoidal, false});
  all.push_back({"steady", GateShape::steady(), Sampling::standard, true});
  return all;
}

/// Random signs: of equal size, so that connections of gradients pick every gate alike, as those of images do.
GatedImage random_adjoint(const GatedImage& like, std::uint64_t seed) {
  GatedImage adjoint = like;
  Rng rng(Stream{seed, 0, 0}, 0, 0);
  for (double& a : adjoint.data) a = rng.uniform() < 0.5 ? -1 : 1;
  return adjoint;
}

class Sinks : public ::testing::TestWithParam<bool> {};

TEST_P(Sinks, AdjointIsTheTransposeOfTheJacobian) {
  const Scene scene = make_scene(GetParam());
  const std::vector<Motion> motions = all_motions(scene);
  const TangentBasis basis = make_basis(scene, motions);
  for (const SinkSetting& s : settings()) {
    const GateSet gates(s.shape, {4.9, 5.6, 5.8});
    const Renderer renderer(scene, gates, {.max_bounces = 3, .sampling = s.sampling, .antithetic = s.antithetic},
                            &basis);
    ASSERT_EQ(renderer.mix().interior_connections, s.sampling == Sampling::ellipsoidal);
    for (const Term term : kTerms) {
      SCOPED_TRACE(std::string(s.name) + (s.sampling == Sampling::standard ? ", standard, " : ", ellipsoidal, ") +
                   name(term));
      const Stream stream{11, 5, 1 + static_cast<std::uint32_t>(term)};
      const SampleRange range{3, 67};
      const std::vector<GatedImage> images = renderer.derive(term, stream, range);
      ASSERT_EQ(images.size(), motions.size());
      ASSERT_EQ(images[0].channels, GetParam() ? 1 : 3);
      // Four that are summed side by side, and one more.
      std::vector<GatedImage> adjoints;
      for (const std::uint64_t seed : {99, 98, 97, 96, 95}) adjoints.push_back(random_adjoint(images[0], seed));
      std::vector<std::vector<double>> dof_gradients(5, std::vector<double>(DofLayout(scene).size(), 0.0));
      renderer.add_gradients(term, adjoints, stream, range, dof_gradients);
      const auto alone = [&](std::size_t adjoint) {
        std::vector<double> gradient(dof_gradients[adjoint].size(), 0.0);
        renderer.add_gradient(term, adjoints[adjoint], stream, range, gradient);
        return gradient;
      };
      EXPECT_EQ(alone(4), dof_gradients[4]);
      const std::vector<double> second = alone(1);
      const double largest = std::abs(*std::ranges::max_element(second, {}, [](double g) { return std::abs(g); }));
      // Compilers may fuse products and sums of one otherwise than of four.
      for (std::size_t i = 0; i < second.size(); ++i) EXPECT_NEAR(second[i], dof_gradients[1][i], 1e-12 * largest) << i;
      TangentBasis absolute = basis;
      for (auto& e : absolute.entries) e.coefficient = std::abs(e.coefficient);
      for (std::size_t a = 0; a < adjoints.size(); ++a) {
        const std::vector<double> gradient = basis.transpose_apply(dof_gradients[a]);
        std::vector<double> magnitude(dof_gradients[a]);
        for (double& g : magnitude) g = std::abs(g);
        const std::vector<double> scales = absolute.transpose_apply(magnitude);
        for (std::size_t c = 0; c < motions.size(); ++c) {
          double sum = 0, scale = scales[c];
          for (std::size_t i = 0; i < images[c].data.size(); ++i) {
            sum += adjoints[a].data[i] * images[c].data[i];
            scale += std::abs(adjoints[a].data[i] * images[c].data[i]);
          }
          EXPECT_NEAR(sum, gradient[c], 1e-11 * scale) << "column " << c << ", adjoint " << a;
          const bool geometry = c < 4;
          const bool expected = term == Term::interior
                                    ? true
                                    : geometry && (term == Term::visibility ||
                                                   (s.shape.kind() != GateKind::gaussian && !s.shape.is_steady()));
          EXPECT_EQ(scale > 0, expected) << "column " << c;
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, Sinks, ::testing::Bool(), [](const auto& test) { return test.param ? "Grey" : "Rgb"; });

/// Explicit zeros wherever `whole` has entries: the same parts count as moving, so that the same samples are
/// taken.
TangentBasis single_column(const TangentBasis& whole, int column) {
  TangentBasis one;
  one.columns = 1;
  one.row_begin.push_back(0);
  for (std::size_t row = 0; row + 1 < whole.row_begin.size(); ++row) {
    double coefficient = 0;
    for (int e = whole.row_begin[row]; e < whole.row_begin[row + 1]; ++e)
      if (whole.entries[e].column == column) coefficient = whole.entries[e].coefficient;
    if (whole.differentiates(static_cast<int>(row))) one.entries.push_back({0, coefficient});
    one.row_begin.push_back(static_cast<int>(one.entries.size()));
  }
  return one;
}

TEST(Jacobian, ColumnsEqualSingleTangents) {
  const Scene scene = make_scene(false);
  const std::vector<Motion> motions = all_motions(scene);
  const TangentBasis whole = make_basis(scene, motions);
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const GateSet gates(GateShape::truncated_gaussian(0.2, 0.3), {4.9, 5.6});
    const EstimatorOptions options{.max_bounces = 3, .sampling = sampling};
    const Renderer renderer(scene, gates, options, &whole);
    for (const Term term : kTerms) {
      const Stream stream{21, 0, 1};
      const std::vector<GatedImage> all = renderer.derive(term, stream, {0, 24});
      for (std::size_t c = 0; c < motions.size(); ++c) {
        const TangentBasis one = single_column(whole, static_cast<int>(c));
        const Renderer alone(scene, gates, options, &one);
        EXPECT_EQ(alone.derive(term, stream, {0, 24})[0].data, all[c].data) << name(term) << ", column " << c;
      }
    }
  }
}

/// Motions of the same vertices need no such zeros.
TEST(Jacobian, ColumnsOfOneShapeEqualSingleTangents) {
  const Scene scene = make_scene(true);
  const std::vector<Motion> motions{translate(scene, "block", {1, 0, 0}), translate(scene, "block", {0.2, 0.5, 0}),
                                    rotate_y(scene, "block", {0.1, 0, 3})};
  const TangentBasis whole = make_basis(scene, motions);
  const GateSet gates(GateShape::boxcar(0.5), {4.9, 5.6});
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const EstimatorOptions options{.max_bounces = 2, .sampling = sampling};
    const Renderer renderer(scene, gates, options, &whole);
    for (const Term term : kTerms) {
      const std::vector<GatedImage> all = renderer.derive(term, {31, 0, 1}, {0, 24});
      for (std::size_t c = 0; c < motions.size(); ++c) {
        const TangentBasis one = make_basis(scene, {motions[c]});
        const Renderer alone(scene, gates, options, &one);
        const auto image = alone.derive(term, {31, 0, 1}, {0, 24});
        EXPECT_EQ(image[0].data, all[c].data) << name(term) << ", column " << c;
      }
    }
  }
}

TEST(Jacobian, NothingMovesWithoutEntries) {
  const Scene scene = make_scene(true);
  TangentBasis empty;
  empty.columns = 2;
  empty.row_begin.assign(DofLayout(scene).size() + 1, 0);
  const GateSet gates(GateShape::boxcar(0.5), {4.9, 5.6});
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const Renderer renderer(scene, gates, {.max_bounces = 2, .sampling = sampling}, &empty);
    for (const Term term : kTerms) {
      const auto images = renderer.derive(term, {1, 0, 1}, {0, 4});
      ASSERT_EQ(images.size(), 2u);
      for (const GatedImage& image : images)
        for (double v : image.data) ASSERT_EQ(v, 0);
      std::vector<double> gradient(DofLayout(scene).size(), 0.25);
      renderer.add_gradient(term, random_adjoint(images[0], 1), {1, 0, 1}, {0, 4}, gradient);
      for (double g : gradient) ASSERT_EQ(g, 0.25);
    }
    EXPECT_EQ(renderer.rays(), 0);
  }
}

}  // namespace
}  // namespace isochron::testing
