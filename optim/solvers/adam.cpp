#include "optim/solvers/adam.h"

#include "optim/solvers/optimizer.h"
#include "optim/solvers/sample_share.h"

namespace isochron {
namespace {

class Adam : public Optimizer {
 public:
  Adam(const OptimizerSpec& spec, const Preconditioner& preconditioner)
      : learning_rate_(spec.learning_rate),
        iterations_(spec.iterations),
        most_parts_(spec.sample_parts),
        preconditioner_(preconditioner),
        decay_(spec.decay),
        share_(most_parts_) {}

  Evaluation evaluate(const Objective& objective, const std::vector<double>& theta,
                      std::uint32_t iteration) const override {
    const bool last = static_cast<int>(iteration) >= iterations_;
    return last ? objective.evaluate(theta, iteration) : objective.evaluate_part(theta, iteration, share_.parts());
  }

  std::vector<double> step(const Objective& objective, Evaluation now, const std::vector<double>& theta,
                           std::uint32_t iteration, double rate) override {
    std::vector<double> next = theta;
    share_.observe(now.gradient);
    const double factor = rate * decay_.factor(static_cast<int>(iteration));
    adam_step({.learning_rate = learning_rate_ * factor}, now.gradient, objective.lower(), objective.upper(), state_,
              next, preconditioner_);
    return next;
  }
  void reset() override {
    state_ = {};
    share_ = SampleShare(most_parts_);
  }
  OptimizerState state() const override {
    return {
        {"steps", {static_cast<double>(state_.steps)}}, {"m", state_.m}, {"v", state_.v}, {"share", share_.state()}};
  }
  void restore(const OptimizerState& state) override {
    state_ = {static_cast<long long>(state.at("steps").at(0)), state.at("m"), state.at("v")};
    share_.restore(state.at("share"));
  }

 private:
  double learning_rate_;
  int iterations_, most_parts_;
  const Preconditioner& preconditioner_;
  RateDecay decay_;
  AdamState state_;
  SampleShare share_;
};

}  // namespace

std::unique_ptr<Optimizer> make_adam(const OptimizerSpec& spec, const Preconditioner& preconditioner) {
  return std::make_unique<Adam>(spec, preconditioner);
}

}  // namespace isochron
