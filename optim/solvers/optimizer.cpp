#include "optim/solvers/optimizer.h"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <utility>

namespace isochron {

// In files of their names.
std::unique_ptr<Optimizer> make_adam(const OptimizerSpec& spec, const Preconditioner& preconditioner);
std::unique_ptr<Optimizer> make_lbfgs(const OptimizerSpec& spec);
std::unique_ptr<Optimizer> make_levenberg_marquardt();
std::unique_ptr<Optimizer> make_quasi_newton(const OptimizerSpec& spec);

namespace {

/// An objective in the unknowns u = theta / scale.
class ScaledObjective : public Objective {
 public:
  ScaledObjective(const Objective& objective, const std::vector<double>& scales)
      : objective_(objective), scales_(scales), lower_(to_u(objective.lower())), upper_(to_u(objective.upper())) {}

  const std::vector<double>& lower() const override { return lower_; }
  const std::vector<double>& upper() const override { return upper_; }
  double loss(const std::vector<double>& u, std::uint32_t iteration) const override {
    return objective_.loss(to_theta(u), iteration);
  }
  Evaluation evaluate(const std::vector<double>& u, std::uint32_t iteration) const override {
    return scaled(objective_.evaluate(to_theta(u), iteration));
  }
  Evaluation linearise(const std::vector<double>& u, std::uint32_t iteration) const override {
    return scaled(objective_.linearise(to_theta(u), iteration));
  }
  std::vector<std::vector<double>> probe_curvature(const std::vector<double>& u, std::uint32_t iteration,
                                                   const Evaluation& now, Probes probes) const override {
    std::vector<std::vector<double>> diagonals = objective_.probe_curvature(to_theta(u), iteration, now, probes);
    for (std::vector<double>& diagonal : diagonals)
      for (std::size_t i = 0; i < diagonal.size(); ++i) diagonal[i] *= scales_[i] * scales_[i];
    return diagonals;
  }
  std::vector<Coupling> couplings() const override {
    std::vector<Coupling> result = objective_.couplings();
    for (Coupling& c : result) c.curvature *= scales_[c.a] * scales_[c.b];
    return result;
  }

  std::vector<double> to_u(std::vector<double> theta) const {
    for (std::size_t i = 0; i < theta.size(); ++i) theta[i] /= scales_[i];
    return theta;
  }
  /// Rounding must not lead over a bound, nor leave what lies on one a little inside.
  std::vector<double> to_theta(std::vector<double> u) const {
    for (std::size_t i = 0; i < u.size(); ++i) {
      const double low = objective_.lower()[i], high = objective_.upper()[i];
      u[i] = u[i] <= lower_[i] ? low : u[i] >= upper_[i] ? high : std::clamp(u[i] * scales_[i], low, high);
    }
    return u;
  }
  /// Derivatives with respect to u.
  Evaluation scaled(Evaluation e) const {
    const std::size_t n = scales_.size();
    for (std::size_t i = 0; i < e.gradient.size(); ++i) e.gradient[i] *= scales_[i];
    for (std::vector<double>* matrix : {&e.curvature, &e.curvature_bound})
      for (std::size_t k = 0; k < matrix->size(); ++k) (*matrix)[k] *= scales_[k / n] * scales_[k % n];
    return e;
  }

 private:
  const Objective& objective_;
  const std::vector<double>& scales_;
  std::vector<double> lower_, upper_;
};

class Scaled : public Optimizer {
 public:
  Scaled(std::unique_ptr<Optimizer> inner, const std::vector<double>& scales)
      : inner_(std::move(inner)), scales_(scales) {}

  Evaluation evaluate(const Objective& objective, const std::vector<double>& theta,
                      std::uint32_t iteration) const override {
    return inner_->evaluate(objective, theta, iteration);
  }
  std::vector<double> step(const Objective& objective, Evaluation now, const std::vector<double>& theta,
                           std::uint32_t iteration, double rate) override {
    const ScaledObjective scaled(objective, scales_);
    const std::vector<double> u = scaled.to_u(theta);
    const std::vector<double> next = inner_->step(scaled, scaled.scaled(std::move(now)), u, iteration, rate);
    std::vector<double> result = scaled.to_theta(next);
    for (std::size_t i = 0; i < result.size(); ++i)
      if (next[i] == u[i]) result[i] = theta[i];  // what does not move keeps its bits
    return result;
  }
  bool rejected() const override { return inner_->rejected(); }
  bool stuck() const override { return inner_->stuck(); }
  bool scatters() const override { return inner_->scatters(); }
  void reset() override { inner_->reset(); }
  OptimizerState state() const override { return inner_->state(); }
  void restore(const OptimizerState& state) override { inner_->restore(state); }

 private:
  std::unique_ptr<Optimizer> inner_;
  std::vector<double> scales_;
};

std::unique_ptr<Optimizer> make_unscaled(const OptimizerSpec& spec, const Preconditioner& preconditioner) {
  switch (spec.method) {
    case OptimizerMethod::adam:
      return make_adam(spec, preconditioner);
    case OptimizerMethod::lbfgs:
      return make_lbfgs(spec);
    case OptimizerMethod::levenberg_marquardt:
      return make_levenberg_marquardt();
    case OptimizerMethod::quasi_newton:
      return make_quasi_newton(spec);
  }
  throw std::logic_error("unknown method");
}

}  // namespace

std::unique_ptr<Optimizer> make_optimizer(const OptimizerSpec& spec, const Preconditioner& preconditioner,
                                          const std::vector<double>& scales) {
  std::unique_ptr<Optimizer> method = make_unscaled(spec, preconditioner);
  if (std::all_of(scales.begin(), scales.end(), [](double scale) { return scale == 1; })) return method;
  return std::make_unique<Scaled>(std::move(method), scales);
}

}  // namespace isochron
