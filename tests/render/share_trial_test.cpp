// One trial tells what every share of connections would cost: against images rendered with each share.
//
// Statistics: both are variances from 64 batches of 256 pixels. Over 8 seeds their ratio has a standard deviation of 0.02 to 0.05;
// the tolerance is five of the largest (false alarms: 6e-7 each, 1e-5 for the file).
#include "core/render/share_trial.h"

#include <gtest/gtest.h>

#include "core/render/renderer.h"
#include "tests/render/pixel_statistics.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

struct TrialCase {
  const char* name;
  bool derivative;
  double light;
  int block;
};
void PrintTo(const TrialCase& c, std::ostream* out) {
  *out << c.name;
}

class ShareTrials : public ::testing::TestWithParam<TrialCase> {};

TEST_P(ShareTrials, TellWhatEveryShareCosts) {
  constexpr int kBatches = 64, kTrialSamples = 4, kSamples = 8;  // whole numbers of each kind under every share
  const auto [name, derivative, light, block] = GetParam();
  const Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  const GateSet gates(GateShape::gaussian(0.3), {5.0, 6.0});
  const TangentBasis basis = make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3})});
  EstimatorOptions options{.max_bounces = 3, .numbers = Numbers::independent, .keep_length = false, .light = light};
  double work = 0;
  const auto costs = measure_shares({.scene = scene,
                                     .gates = gates,
                                     .options = options,
                                     .column = derivative ? &basis : nullptr,
                                     .block = block,
                                     .samples = kTrialSamples,
                                     .batches = kBatches,
                                     .most_samples = 1e9},
                                    {1, 2, 3}, work)
                         .cost;
  ASSERT_TRUE(costs);
  EXPECT_GT(work, 0);
  for (std::size_t k = 0; k < kConnectionShares.size(); ++k) {
    options.mix = SamplingMix{.image = kConnectionShares[k], .interior = kConnectionShares[k]};
    const Renderer renderer(scene, gates, options, &basis);
    PixelBatches images;
    for (int b = 0; b < kBatches; ++b) {
      const SampleRange range{b * kSamples, (b + 1) * kSamples};
      const GatedImage image =
          derivative ? renderer.derive(Term::interior, {4, 5, 6}, range)[0] : renderer.render({4, 5, 6}, range);
      images.add(block == 1 ? image : blocks(image, block));
    }
    double variance = 0;
    for (std::size_t i = 0; i < images.mean().data.size(); ++i) variance += images.variance(i) * kBatches;
    const double sums = double{1} * block * block * block * block;  // blocks() averages
    EXPECT_NEAR((*costs)[k] / (variance * sums * renderer.work() / kBatches), 1, 0.25)
        << "share " << kConnectionShares[k];
  }
}

INSTANTIATE_TEST_SUITE_P(Of, ShareTrials,
                         ::testing::Values(TrialCase{"images", false, 0, 1},
                                           TrialCase{"images_with_light", false, 0.5, 1},
                                           TrialCase{"derivatives", true, 0, 1},
                                           TrialCase{"sums_of_images", false, 0.5, 4}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace isochron::testing
