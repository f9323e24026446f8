// Whether a run's result explains its counts: goodness_of_fit.h for an experiment.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "optim/problem/goodness_of_fit.h"
#include "optim/problem/problem.h"
#include "optim/run/checkpoint.h"
#include "optim/run/log.h"

namespace isochron {

/// Whether the target is counts: the loss is Poisson's and all readings are whole numbers.
bool has_fit(const Problem& problem, const GatedImage& target);

/// Samples of the expected counts that the fit is judged by: output.histogram_samples; where there is a camera no more than 16
/// iterations take.
int fit_samples(const Problem& problem);

/// Of each unknown, whether it lies off its bounds and is that of no background.
std::vector<char> free_unknowns(const Problem& problem, const std::vector<double>& theta);

/// `image`: expected counts at theta. `determined`: of the free unknowns, where penalties hold some (determined_unknowns); else all are.
/// `background`: see judge_fit in goodness_of_fit.h.
GoodnessOfFit judge_fit(const Problem& problem, const std::vector<double>& theta, const SplitImage& image,
                        const GatedImage& target, std::optional<double> determined = {},
                        const std::optional<DevianceTest>& background = std::nullopt);

/// Most of the deviance's variance that noise of the expected counts may make (DevianceTest::image_share): whatever its law, the
/// spread is then known to some per cent.
inline constexpr double kMostImageShare = 0.05;

/// Each renders as many samples as all before.
inline constexpr int kMostDoublings = 4;

/// The same for expected counts that are rendered into `image`, with fit_samples(). Captures get more, twice as many each time, where
/// noise makes too much of the variance, `doublings` times at most.
GoodnessOfFit judge_rendered_fit(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                                 SplitImage& image, std::optional<double> determined = {},
                                 int doublings = kMostDoublings);

/// Whether a run has left its data behind: they hold light of which the fit has nothing (GoodnessOfFit::lost), or the fit
/// neither explains them nor is as good as its start, by three standard errors of the loss.
bool left_its_data(const GoodnessOfFit& fit, const Checkpoint& state, const LogRow& last);

/// The key `fit` of summary.yaml; nothing where there is none.
std::string fit_yaml(const std::optional<GoodnessOfFit>& fit);

/// A line for the screen, indented by two blanks; nothing where there is none.
std::string fit_report(const std::optional<GoodnessOfFit>& fit);

}  // namespace isochron
