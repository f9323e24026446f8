// A loss that the caller computes from images, in place of the experiment's.
#pragma once
#include <functional>

#include "optim/problem/rendered_objective.h"

namespace isochron {

/// A loss of one image, and its derivative by each of the image's values.
struct ImageLoss {
  double value = 0;
  GatedImage adjoint;
};

/// Is called with images of the experiment's shape, from the thread that optimises. What it throws leaves the optimisation.
using OwnLoss = std::function<ImageLoss(const GatedImage& image)>;

/// Whether the experiment has images to aim at, read or rendered at target values.
bool has_target(const Problem& problem);

/// Throws InputError where the experiment asks for what only its own loss has: methods that linearise, penalties, levels.
void require_for_own_loss(const Problem& problem);

/// A loss f has a bias from the noise of its image, as loss.h says of squares. Images come in halves I1 and I2 with
/// fractions w and 1 - w of the samples, and I is their mean: 2 f(I) - w f(I1) - (1 - w) f(I2) is without the bias of first
/// order in the variance, of squares without any. The derivative likewise. So f is called three times.
class OwnLossObjective : public RenderedObjective {
 public:
  /// All must outlive this. `target`, where has_target(), is for the mean squared error alone.
  OwnLossObjective(const Problem& problem, const GatedImage& target, const OwnLoss& loss)
      : RenderedObjective(problem, target), loss_(loss) {}

  double loss(const std::vector<double>& theta, std::uint32_t iteration) const override;
  /// The standard error of the loss is that of its first derivative: too large, by up to 1.4 times, where that is noise.
  Evaluation evaluate(const std::vector<double>& theta, std::uint32_t iteration) const override;
  /// Of all samples.
  Evaluation evaluate_part(const std::vector<double>& theta, std::uint32_t iteration, int parts) const override;
  /// Not for such losses: throw std::logic_error.
  Evaluation linearise(const std::vector<double>& theta, std::uint32_t iteration) const override;
  std::vector<std::vector<double>> probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                   const Evaluation& now, Probes probes) const override;

 private:
  ImageLoss unbiased(const SplitImage& image) const;

  const OwnLoss& loss_;
};

}  // namespace isochron
