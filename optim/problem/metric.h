// The metric of quasi_newton: what a gradient is divided by.
#pragma once
#include <memory>
#include <vector>

#include "optim/problem/objective.h"

namespace isochron {

/// A diagonal, and what is known beside it, of those unknowns that may move; vectors are of all unknowns, and what they have
/// elsewhere counts as 0.
class Metric {
 public:
  /// diagonal > 0 at the `free` unknowns, and at least what the couplings need for a semidefinite matrix. The diagonal must outlive this.
  Metric(const std::vector<double>& diagonal, const std::vector<Coupling>& couplings, std::vector<std::size_t> free);
  ~Metric();
  const std::vector<std::size_t>& free() const { return free_; }
  double dot(const std::vector<double>& a, const std::vector<double>& b) const;
  std::vector<double> times(const std::vector<double>& v) const;
  std::vector<double> solve(const std::vector<double>& v) const;

 private:
  template <class Single, class Together>
  std::vector<double> of_free(const std::vector<double>& v, Single&& single, Together&& together) const;

  const std::vector<double>& diagonal_;
  std::vector<std::size_t> free_;
  struct Factors;
  std::unique_ptr<const Factors> factors_;  ///< null without couplings
};

}  // namespace isochron
