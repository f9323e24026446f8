// Bodies that touch and move against each other: their vertices follow each other (VertexFlows), so that derivatives have
// a variance, without bias.
//
// Statistics: z-tests at 4.5 standard errors of the difference from finite differences with other random numbers, fixed
// seeds (false alarms: 5e-4 each by Student's law for 16 replicates, and by chi^2 for their errors), whose errors must be a few per cent
// of the larger term.
#include <gtest/gtest.h>

#include "tests/render/contact_scenes.h"

namespace isochron::testing {
namespace {

using contact::ContactCase;

class Contact : public ::testing::TestWithParam<ContactCase> {};

TEST_P(Contact, DerivativeIsThatOfFiniteDifferences) {
  constexpr int kBatches = 16;
  const contact::Comparison r = contact::compare(GetParam(), 1, kBatches);
  EXPECT_LT(r.error(), scatter_of_errors(kBatches) * GetParam().error);
  EXPECT_LT(std::abs(r.z()), 4.5) << r.total.mean << " +- " << r.total.standard_error << " (interior "
                                  << r.interior.mean << " +- " << r.interior.standard_error << ", visibility "
                                  << r.visibility.mean << " +- " << r.visibility.standard_error
                                  << "), finite difference " << r.difference.mean << " +- "
                                  << r.difference.standard_error;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Contact, ::testing::ValuesIn(contact::cases()),
                         [](const auto& test) { return test.param.name; });

/// Sum over pixels of the variance of the derivative's mean, by the box's motion, over four bounces.
double variance_of_pixels(double raised, double follow) {
  Scene scene = contact::with_box();
  const Shape& shape = scene.shapes.back();
  for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v) scene.positions[v].y += raised;
  const TangentBasis basis = make_basis(scene, {contact::slide(scene)});
  const GateSet gates(GateShape::steady(), {0});
  const Renderer renderer(scene, gates, {.max_bounces = 4, .sampling = Sampling::standard, .follow = follow}, &basis);
  constexpr int kBatches = 32, kSamples = 64;
  std::vector<Batches> pixels(scene.camera.width * scene.camera.height);
  for (int b = 0; b < kBatches; ++b) {
    const GatedImage image = renderer.derive(Term::interior, {54, 0, 0}, {b * kSamples, (b + 1) * kSamples})[0];
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].add(image.data[i * image.channels]);
  }
  double sum = 0;
  for (const Batches& p : pixels) sum += std::pow(p.estimate().standard_error, 2);
  return sum;
}

// Measured: 0.8 to 1.9, and 9 to 50 where nothing follows.
TEST(Contact, StandingOnTheFloorIsAsQuietAsHangingAboveIt) {
  const double hanging = variance_of_pixels(0.1, 1);
  EXPECT_LT(variance_of_pixels(0, 1), 4 * hanging);
  EXPECT_GT(variance_of_pixels(0, 0), 6 * hanging) << "the test must notice what it is for";
}

}  // namespace
}  // namespace isochron::testing
