// What the standard errors of the losses say about a run: whether it can be seen to descend, and how much of the
// spread of its losses is noise.
//
// Descent. The first rows make a block of a tenth of the iterations, 5 rows at least and 50 at most; the following rows
// make more such blocks. The descent is visible once the mean loss of a block lies below that of the first by twice the
// standard error of the difference, which comes from the standard errors of single losses, so that a trend within a
// block does not add to it. Where that has not happened after a fifth of the iterations, two blocks at least, and the
// mean has not risen as clearly either, noise hides the descent. A run whose loss really falls by 4 standard errors is
// taken for one with probability 0.023, by 6 with 3e-5 (none of the shipped experiments is); one whose loss stays the same is found with
// probability 0.95.
//
// Average. The parameters of the last three quarters of the iterations, 100 rows at most, are summed. Where the losses did not
// visibly fall meanwhile (their first half to their second, by less than 3 standard errors: an optimisation without any
// trend is taken for one that falls with probability 0.0013) the mean has less noise than the last row.
#pragma once
#include <string>
#include <vector>

namespace isochron {

/// Plain data, all of it kept in checkpoints.
struct DescentState {
  std::vector<double> first, first_noise;    ///< losses of the first block and their standard errors
  std::vector<double> recent, recent_noise;  ///< of the last 100 rows at most, the newest last
  std::vector<double> theta_sum;             ///< over the rows to be averaged so far
  int summed = 0;                            ///< rows in it
  bool judged = false;                       ///< the descent was visible, or the user has been told that it is not
};

class Descent {
 public:
  explicit Descent(int iterations, DescentState state = {});
  /// Takes the loss of one row into account. Returns a line for the user where noise hides the descent (once in a run),
  /// else nothing. Losses that are not finite are passed over.
  std::string observe(int iteration, const std::vector<double>& theta, double loss, double noise);
  /// After a rejection: nothing before it is averaged.
  void restart_average();
  /// Whether all rows to be averaged have been seen, and without a visible fall of the loss.
  bool settled() const;
  std::vector<double> settled_theta() const;
  const DescentState& state() const { return state_; }

 private:
  int iterations_, block_;
  int averaged_;  ///< rows
  DescentState state_;
};

/// Of the last 20 rows, or as many as there are.
struct LossSpread {
  int rows = 0;
  double deviation = 0;    ///< standard deviation of the losses; NaN for fewer than 5 rows
  double noise = 0;        ///< root mean square of their standard errors
  double noise_share = 0;  ///< of their variance, 1 at most: the rest is change from row to row; NaN as above
};
LossSpread loss_spread(const DescentState& state);

}  // namespace isochron
