// Images and gradients sorted by bounces, gates and shapes: their sums are those of the unsorted passes, from
// the same random numbers, and what they hold up to some number of bounces is what a renderer that stops
// there finds.
#include <gtest/gtest.h>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

/// A sloping adjoint, of both signs.
GatedImage adjoint_for(const Scene& scene, const GateSet& gates, double shift) {
  GatedImage adjoint(scene.camera.width, scene.camera.height, gates.size(), scene.grey ? 1 : 3);
  for (std::size_t i = 0; i < adjoint.data.size(); ++i) adjoint.data[i] = std::sin(0.37 * i) + shift;
  return adjoint;
}

struct BreakdownCase {
  const char* name;
  Sampling sampling;
};
void PrintTo(const BreakdownCase& c, std::ostream* out) {
  *out << c.name;
}

class Breakdown : public ::testing::TestWithParam<BreakdownCase> {
 protected:
  Breakdown() : scene_(load_scene(TEST_DATA "/reference/scene.yaml")) {
    scene_.camera.width = scene_.camera.height = 6;
    basis_ = make_basis(scene_, {rotate_y(scene_, "block", {-0.2, -0.4, 0.15}), translate(scene_, "light", {0, 0, 1})});
  }
  EstimatorOptions options(int max_bounces) const {
    EstimatorOptions options;
    options.max_bounces = max_bounces;
    options.sampling = GetParam().sampling;
    options.guiding_samples = 32;
    return options;
  }
  Scene scene_;
  TangentBasis basis_;
  GateSet gates_{GateShape::truncated_gaussian(0.1, 0.15), {5.0, 6.0, 7.0}};
};

void expect_equal(double a, double b, double scale) {
  EXPECT_NEAR(a, b, 1e-9 * std::abs(scale));
}

TEST_P(Breakdown, SumsToTheUnsortedPass) {
  const int bounces = 3;
  const Renderer renderer(scene_, gates_, options(bounces), &basis_);
  const SampleRange range{0, 32};
  const GatedImage image = renderer.render({5, 0, 0}, range);
  const ImageBreakdown sorted = renderer.render_breakdown({5, 0, 0}, range);
  double total = 0;
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    for (int g = 0; g < image.gates; ++g)
      for (int c = 0; c < image.channels; ++c) {
        double sum = 0;
        for (int b = 0; b <= bounces; ++b) sum += sorted.image.at(pixel, b * image.gates + g, c);
        expect_equal(sum, image.at(pixel, g, c), 1);
        total += sum;
      }
  ASSERT_GT(total, 0);
  // All light ends on the lamp.
  expect_equal(sorted.by_shape[scene_.find_shape("light")], total, total);

  const GatedImage adjoint = adjoint_for(scene_, gates_, 0.2);
  for (Term term : kTerms) {
    SCOPED_TRACE(name(term));
    const Stream stream{5, 0, 1 + static_cast<std::uint32_t>(term)};
    std::vector<double> dofs(DofLayout(scene_).size(), 0.0);
    renderer.add_gradient(term, adjoint, stream, range, dofs);
    const std::vector<double> gradient = basis_.transpose_apply(dofs);
    const GradientBreakdown breakdown = renderer.gradient_breakdown(term, std::span(&adjoint, 1), stream, range);
    for (int column = 0; column < 2; ++column) {
      double by_bounces = 0, by_gate = 0, by_shape = 0;
      for (int b = 0; b <= bounces; ++b) by_bounces += breakdown.by_bounces[breakdown.index(b, column)];
      for (int g = 0; g < gates_.size(); ++g) by_gate += breakdown.by_gate[g * 2 + column];
      for (std::size_t s = 0; s < scene_.shapes.size(); ++s) by_shape += breakdown.by_shape[s * 2 + column];
      ASSERT_NE(gradient[column], 0);
      expect_equal(by_bounces, gradient[column], gradient[column]);
      expect_equal(by_gate, gradient[column], gradient[column]);
      // An edge is of one shape; paths meet several, and the lamp always.
      const double shapes =
          term == Term::visibility ? by_shape : breakdown.by_shape[scene_.find_shape("light") * 2 + column];
      expect_equal(shapes, gradient[column], gradient[column]);
    }
  }
}

TEST_P(Breakdown, HoldsWhatFewerBouncesFind) {
  // A walk that may go on draws the same numbers up to where another one stops: both find the same paths.
  // (Not so connections for a length and a pair at the same vertex: see below.)
  const Renderer all(scene_, gates_, options(3), &basis_);
  GatedImage adjoints[2] = {adjoint_for(scene_, gates_, 0.2), adjoint_for(scene_, gates_, 1)};
  for (GatedImage& adjoint : adjoints)  // one walk for every sample
    for (double& a : adjoint.data) a = std::copysign(1.0, a);
  const SampleRange range{0, 16};
  const ImageBreakdown light = all.render_breakdown({6, 0, 0}, range);
  for (int limit : {1, 2}) {
    SCOPED_TRACE(limit);
    const Renderer few(scene_, gates_, options(limit), &basis_);
    const GatedImage image = few.render({6, 0, 0}, range);
    for (int g = 0; g < gates_.size(); ++g) {
      double sorted = 0;
      for (int b = 0; b <= limit; ++b) sorted += light.image.mean(b * gates_.size() + g);
      expect_equal(sorted, image.mean(g), image.mean(g));
    }
    for (Term term : {Term::interior, Term::path_length}) {
      if (term == Term::interior && GetParam().sampling == Sampling::ellipsoidal) continue;
      SCOPED_TRACE(name(term));
      const Stream stream{8, 0, 1 + static_cast<std::uint32_t>(term)};
      const GradientBreakdown breakdown = all.gradient_breakdown(term, adjoints, stream, range);
      const GradientBreakdown stopped = few.gradient_breakdown(term, adjoints, stream, range);
      for (int column = 0; column < 2; ++column)
        for (int j = 0; j < 2; ++j)
          for (int b = 0; b <= limit; ++b) {
            const double value = breakdown.by_bounces[breakdown.index(b, column) + j];
            expect_equal(stopped.by_bounces[breakdown.index(b, column) + j], value, value);
          }
      EXPECT_NE(breakdown.by_bounces[breakdown.index(limit, 1)], 0);  // the lamp moves
    }
  }
}

TEST_P(Breakdown, HoldsWhatFewerBouncesFindOnAverage) {
  // Where random numbers differ: z-tests at 4 standard errors, 2 terms x 2 limits x 2 columns, false alarms
  // 5e-4; the seeds are fixed.
  const GateSet wide(GateShape::gaussian(0.6), {5.5, 6.5});
  const bool standard = GetParam().sampling == Sampling::standard;
  const GateSet& gates = standard ? wide : gates_;
  GatedImage adjoint = adjoint_for(scene_, gates, 0);
  for (double& a : adjoint.data) a = 1;
  constexpr int kBatches = 24;
  const Renderer all(scene_, gates, options(3), &basis_);
  for (int limit : {1, 2}) {
    const Renderer few(scene_, gates, options(limit), &basis_);
    for (Term term : {Term::interior, Term::visibility}) {
      SCOPED_TRACE(name(term) + std::to_string(limit));
      const int samples = term == Term::interior || !standard ? 24 : 256;
      Batches stopped[2], sorted[2];
      for (int i = 0; i < kBatches; ++i) {
        const SampleRange range{i * samples, (i + 1) * samples};
        std::vector<double> dofs(DofLayout(scene_).size(), 0.0);
        few.add_gradient(term, adjoint, {8, 0, 2}, range, dofs);
        const GradientBreakdown breakdown = all.gradient_breakdown(term, std::span(&adjoint, 1), {9, 0, 2}, range);
        for (int column = 0; column < 2; ++column) {
          stopped[column].add(basis_.transpose_apply(dofs)[column]);
          double sum = 0;
          for (int b = 0; b <= limit; ++b) sum += breakdown.by_bounces[breakdown.index(b, column)];
          sorted[column].add(sum);
        }
      }
      for (int column = 0; column < 2; ++column) {
        EXPECT_LT(std::abs(z_score(stopped[column].estimate(), sorted[column].estimate())), 4) << column;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Samplings, Breakdown,
                         ::testing::Values(BreakdownCase{"standard", Sampling::standard},
                                           BreakdownCase{"ellipsoidal", Sampling::ellipsoidal}),
                         ::testing::PrintToStringParamName());

}  // namespace
}  // namespace isochron::testing
