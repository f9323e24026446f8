// The loss of an experiment's images as the optimisers see it.
#pragma once
#include "optim/problem/objective.h"
#include "optim/problem/problem.h"

namespace isochron {

/// The most that linearise() and a step on its result may take, in bytes: two halves of the Jacobian, residuals x
/// unknowns, and matrices of unknowns x unknowns.
inline constexpr double kMostLinearisationBytes = 2e9;

/// Throws InputError when the image has a single sample per pixel, of which no loss can be estimated without bias.
void require_two_samples(const Problem& problem);

/// The same, when there are no parameters, and when the experiment's method is Levenberg-Marquardt and its linearisation would be too large.
void require_optimisable(const Problem& problem);

class RenderedObjective : public Objective {
 public:
  /// Both must outlive this.
  RenderedObjective(const Problem& problem, const GatedImage& target) : problem_(problem), target_(target) {}

  const std::vector<double>& lower() const override { return problem_.parameters().lower(); }
  const std::vector<double>& upper() const override { return problem_.parameters().upper(); }
  /// From two halves of the image's samples, as all losses here; see loss.h.
  double loss(const std::vector<double>& theta, std::uint32_t iteration) const override;
  Evaluation evaluate(const std::vector<double>& theta, std::uint32_t iteration) const override;
  /// No fewer than two samples of the image and one of each term.
  Evaluation evaluate_part(const std::vector<double>& theta, std::uint32_t iteration, int parts) const override;
  /// See jacobian.h.
  Evaluation linearise(const std::vector<double>& theta, std::uint32_t iteration) const override;
  std::vector<std::vector<double>> probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                   const Evaluation& now, Probes probes) const override;
  std::vector<Coupling> couplings() const override;

 protected:
  /// The image of an iteration, in halves.
  SplitImage render(const std::vector<double>& theta, std::uint32_t iteration) const;
  const Problem& problem() const { return problem_; }
  const GatedImage& target() const { return target_; }

 private:
  const Problem& problem_;
  const GatedImage& target_;
};

}  // namespace isochron
