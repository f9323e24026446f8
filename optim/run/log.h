// DIR/log.csv. Row i is the state before step i (i counts from 0), as seen by the random numbers of iteration
// i, so that N iterations have the rows 0 to N. Where the final parameters are not those of row N, but an average or the best,
// row N + 1 is of them. The last row of a finished run is therefore of the
// final parameters.
#pragma once
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "optim/problem/parameters.h"

namespace isochron {

struct LogRow {
  int iteration = 0;         ///< one past the last one: of final parameters that no iteration had
  double seconds = 0;        ///< spent in iterations so far, this one included
  double loss = 0;           ///< can lie below 0, see loss.h
  double image_rmse = 0;     ///< see root_mean_square_error
  double param_rmse = 0;     ///< NaN where target values are unknown: written as an empty field
  double gradient_norm = 0;  ///< of dLoss/dtheta times scale
  double loss_noise = 0;     ///< standard error of `loss`
};

class Log {
 public:
  /// Opens the log to go on at row `next`: rows from there on, and a torn last line, are cut off. Throws
  /// std::runtime_error.
  Log(const std::string& file, const Parameters& parameters, int next);
  /// Writes one line and flushes it to the disk: the row, values of the parameters, for each parameter NAME.rmse (the
  /// distance to its target; empty where that is unknown), and derivatives of the loss, NAME.gradient. All these are in
  /// units of the parameter. Parameters of more than 16 components are written as NAME.norm and NAME.gradient_norm, the
  /// Euclidean norms.
  void append(const LogRow& row, const std::vector<double>& theta, const std::vector<double>& gradient);

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string name_;
  const Parameters& parameters_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace isochron
