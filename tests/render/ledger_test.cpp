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

struct Case {
  const char* name;
  Sampling sampling;
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << c.name;
}

class Ledger : public ::testing::TestWithParam<Case> {
 protected:
  Ledger() : scene_(load_scene(TEST_DATA "/reference/scene.yaml")) {
    scene_.camera.width = scene_.camera.height = 6;
    basis_ = make_basis(
        scene_, {rotate_y(scene_, "block", {-0.2, -0.4, 0.15}), translate(scene_, "light", {0, 0, 1})});
  }
  EstimatorOptions options(int max_bounces) const {
    EstimatorOptions options;
    options.max_bounces = max_bounces;
    options.sampling = GetParam().sampling;
    options.guiding_samples = 8;
    return options;
  }
  Scene scene_;
  TangentBasis basis_;
  GateSet gates_{GateShape::truncated_gaussian(0.1, 0.15), {5.0, 6.0, 7.0}};
};

void expect_equal(double a, double b, double scale) {
  EXPECT_NEAR(a, b, 1e-9 * std::abs(scale));
}

TEST_P(Ledger, SumsToTheUnsortedPass) {
  const int bounces = 3;
  const Renderer renderer(scene_, gates_, options(bounces), &basis_);
  const SampleRange range{0, 32};
  const GatedImage image = renderer.render({5, 0, 0}, range);
  const ImageLedger sorted = renderer.render_ledger({5, 0, 0}, range);
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
    const GradientLedger ledger = renderer.gradient_ledger(term, std::span(&adjoint, 1), stream, range);
    for (int column = 0; column < 2; ++column) {
      double by_bounces = 0, by_gate = 0, by_shape = 0;
      for (int b = 0; b <= bounces; ++b) by_bounces += ledger.by_bounces[ledger.index(b, column)];
      for (int g = 0; g < gates_.size(); ++g) by_gate += ledger.by_gate[g * 2 + column];
      for (std::size_t s = 0; s < scene_.shapes.size(); ++s) by_shape += ledger.by_shape[s * 2 + column];
      ASSERT_NE(gradient[column], 0);
      expect_equal(by_bounces, gradient[column], gradient[column]);
      expect_equal(by_gate, gradient[column], gradient[column]);
      // An edge is of one shape; paths meet several, and the lamp always.
      const double shapes =
          term == Term::visibility ? by_shape : ledger.by_shape[scene_.find_shape("light") * 2 + column];
      expect_equal(shapes, gradient[column], gradient[column]);
    }
  }
}

TEST_P(Ledger, HoldsWhatFewerBouncesFind) {
  // z-tests at 4 standard errors: 1 image and 3 terms x 2 columns at 2 limits, false alarms 14 x 6e-5 = 0.1
  // %; the seeds are fixed.
  const Renderer all(scene_, gates_, options(3), &basis_);
  const GatedImage adjoints[2] = {adjoint_for(scene_, gates_, 0.2), adjoint_for(scene_, gates_, 1)};
  constexpr int kBatches = 24, kSamples = 24;
  for (int limit : {1, 2}) {
    SCOPED_TRACE(limit);
    const Renderer few(scene_, gates_, options(limit), &basis_);
    Batches image_few, image_all;
    for (int i = 0; i < kBatches; ++i) {
      const SampleRange range{i * kSamples, (i + 1) * kSamples};
      const GatedImage image = few.render({6, 0, 0}, range);
      const ImageLedger ledger = all.render_ledger({7, 0, 0}, range);
      double sum = 0, sorted = 0;
      for (int g = 0; g < gates_.size(); ++g) {
        sum += image.mean(g);
        for (int b = 0; b <= limit; ++b) sorted += ledger.image.mean(b * gates_.size() + g);
      }
      image_few.add(sum);
      image_all.add(sorted);
    }
    EXPECT_LT(std::abs(z_score(image_few.estimate(), image_all.estimate())), 4);
    for (Term term : kTerms) {
      SCOPED_TRACE(name(term));
      Batches sums[2], sorted[2];
      for (int i = 0; i < kBatches; ++i) {
        const SampleRange range{i * kSamples, (i + 1) * kSamples};
        const Stream stream{8, static_cast<std::uint32_t>(limit), 1 + static_cast<std::uint32_t>(term)};
        std::vector<double> dofs(DofLayout(scene_).size(), 0.0);
        few.add_gradient(term, adjoints[1], stream, range, dofs);
        const std::vector<double> gradient = basis_.transpose_apply(dofs);
        Stream other = stream;
        other.seed = 9;
        const GradientLedger ledger = all.gradient_ledger(term, adjoints, other, range);
        for (int column = 0; column < 2; ++column) {
          sums[column].add(gradient[column]);
          double sum = 0;
          for (int b = 0; b <= limit; ++b) sum += ledger.by_bounces[ledger.index(b, column) + 1];
          sorted[column].add(sum);
        }
      }
      for (int column = 0; column < 2; ++column)
        EXPECT_LT(std::abs(z_score(sums[column].estimate(), sorted[column].estimate())), 4) << column;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Samplings, Ledger,
                         ::testing::Values(Case{"standard", Sampling::standard},
                                           Case{"ellipsoidal", Sampling::ellipsoidal}),
                         ::testing::PrintToStringParamName());

}  // namespace
}  // namespace isochron::testing
