#include "optim/optimizer.h"

#include <stdexcept>

namespace isochron {

std::unique_ptr<Optimizer> make_optimizer(const OptimizerSpec& spec, const Preconditioner& preconditioner) {
  switch (spec.method) {
    case OptimizerMethod::adam:
      return make_adam(spec.learning_rate, preconditioner, spec.decay);
    case OptimizerMethod::lbfgs:
      return make_lbfgs(spec.learning_rate, spec.inner_iterations);
    case OptimizerMethod::levenberg_marquardt:
      return make_levenberg_marquardt();
  }
  throw std::logic_error("unknown method");
}

}  // namespace isochron
