// Judges the losses of a running optimisation: has it risen, has it settled? Single losses are
// noisy and rise all the time, so all rules compare with the noise that the losses themselves show.
//
// Rise. The *level* is the median of the last 5 losses, the *noise* the median of the absolute differences
// between successive ones of the last 21, divided by 0.954 (for a normal distribution: its standard
// deviation). The loss has risen when each of the last 3 losses exceeds the lowest level so far by more than 6 times the noise. As noise
// changes with the number of samples (sample_share.h), that must also be more than 3 times the standard error that the losses of the lowest
// level state themselves (their median), and 4 times that of the last 5. 8 losses must have been seen since the last rejection. One wild
// loss, or two, is no rise. False alarms in simulated losses without any trend: 1 in 10 000 rows of normal noise, 1 in 2500 of
// noise without a variance (Pareto, 1.5).
//
// Rejection, after a rise or a loss or gradient that is not finite: back to the parameters of the lowest
// level, half the rate. After 5 rejections without a lower level in between the optimisation has diverged.
//
// Settled (where a window is given): rows are cut into blocks of that many. The loss has settled when the
// mean of a block is below that of the block before by less than the standard error of the difference.
// Without any trend left a check says so with probability 0.84; a decrease of 3 standard errors is taken for
// none with probability 0.02.
//
// Plateaus. Losses can be constant for long while gradients are not zero. From windows of 20 rows on the mean
// gradient of the block must be noise, too: the sum over unknowns of squared means in units of their standard errors is no
// more than 3 standard deviations above what unknowns with independent normal noise would have. Unknowns that share
// noise make it larger, which only delays the end. A bound counts as rest for the unknown that it holds.
#pragma once
#include <limits>
#include <vector>

namespace isochron {

/// Plain data, all of it kept in checkpoints.
struct SafeguardState {
  double rate = 1;  ///< factor on every step: 1/2 to the power of `rejected`
  int rejected = 0, rejected_in_row = 0;
  std::vector<double> recent;        ///< the last losses since the last rejection, the newest last
  std::vector<double> recent_noise;  ///< standard errors of those that make the level
  double best_level = std::numeric_limits<double>::infinity(), best_noise = 0;
  std::vector<double> best_theta;                      ///< where best_level was reached
  std::vector<double> block, block_before;             ///< losses
  std::vector<double> theta_sum;                       ///< over the rows of `block`
  std::vector<double> gradient_sum, gradient_squares;  ///< over the same rows; for windows of 20 rows or more
};

enum class Verdict {
  go_on,
  reject,   ///< go back to best_theta
  settled,  ///< settled_theta() is the mean over the last block
  give_up   ///< rejected too often
};

class Safeguard {
 public:
  /// `window`: rows of a block, 0: never settled.
  explicit Safeguard(int window, SafeguardState state = {}) : window_(window), state_(std::move(state)) {}

  /// Takes the row of theta into account. `noise`: standard error of `loss`, 0 where it is not known. `finite`: whether loss and
  /// gradient are. `gradient`: 0 where it leads beyond a bound; empty: not to be judged.
  Verdict observe(double loss, double noise, bool finite, const std::vector<double>& theta,
                  const std::vector<double>& gradient = {});

  /// The rows so far say nothing of whether the loss has settled.
  void restart_window();

  const SafeguardState& state() const { return state_; }
  /// Mean of the parameters over the block that settled: their noise is averaged. Bounds hold for it as for
  /// each.
  std::vector<double> settled_theta() const;

 private:
  bool rises() const;
  bool settles(const std::vector<double>& theta, const std::vector<double>& gradient);
  bool gradient_is_noise() const;
  void clear_sums();
  Verdict reject();

  int window_;
  SafeguardState state_;
};

}  // namespace isochron
