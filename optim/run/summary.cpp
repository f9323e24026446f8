#include "optim/run/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "optim/experiment/files.h"
#include "optim/run/bounds.h"

namespace isochron {
namespace {

std::string optional_number(double value) {
  return std::isnan(value) ? "null" : std::isinf(value) ? (value > 0 ? ".inf" : "-.inf") : exact(value);
}

}  // namespace

std::string summary_yaml(const LoopResult& result, const Checkpoint& state, const LogRow& last,
                         const Parameters& parameters, const RunCost& cost, const ParameterErrors& errors) {
  std::string text =
      fmt::format("status: {}\niterations: {}\nseconds: {}\nrejected_steps: {}\nrate: {}\nfinal: {}\n",
                  name(result.status), state.iteration, std::max(state.seconds, last.seconds),
                  state.safeguard.rejected + state.steps_rejected, state.safeguard.rate, name(result.choice));
  auto out = std::back_inserter(text);
  const auto pair = [&](const char* key, double initial, double final) {
    fmt::format_to(out, "{0}_initial: {1}\n{0}_final: {2}\n", key, optional_number(initial), optional_number(final));
  };
  pair("loss", state.loss_initial, last.loss);
  pair("loss_noise", state.loss_noise_initial, last.loss_noise);
  fmt::format_to(out, "noise_share: {}\n", optional_number(loss_spread(state.descent).noise_share));
  pair("image_rmse", state.image_rmse_initial, last.image_rmse);
  pair("param_rmse", state.param_rmse_initial, last.param_rmse);
  text += "param_rmse_by_parameter:\n";  // in units of the parameter
  for (const Parameters::Block& block : parameters.blocks())
    fmt::format_to(out, "  {}: {{initial: {}, final: {}}}\n", block.name,
                   optional_number(parameters.distance_to_target(parameters.initial(), block)),
                   optional_number(parameters.distance_to_target(state.theta, block)));
  text += bounds_yaml(find_at_bounds(parameters, state.theta));
  if (!errors.values.empty()) {
    fmt::format_to(out, "standard_errors_from: {}\nstandard_errors:\n", errors.from);  // in units of the parameter
    for (const Parameters::Block& block : parameters.blocks()) {
      std::vector<std::string> numbers;
      for (int i = block.begin; i < block.begin + block.count; ++i)
        numbers.push_back(optional_number(errors.values[i]));
      const std::string list = fmt::format("{}", fmt::join(numbers, ", "));
      fmt::format_to(out, "  {}: {}\n", block.name, block.count == 1 ? list : "[" + list + "]");
    }
  }
  std::vector<std::string> passes;
  for (const auto& [name, seconds] : cost.passes) passes.push_back(fmt::format("{}: {:.6g}", name, seconds));
  fmt::format_to(
      out, "last_call: {{first_iteration: {}, seconds: {:.6g}, rays: {}, peak_memory_bytes: {}, passes: {{{}}}}}\n",
      cost.first_iteration, cost.seconds, cost.rays, cost.peak_memory, fmt::join(passes, ", "));
  text += "parameters:\n";
  for (const Parameters::Block& block : parameters.blocks()) {
    const auto begin = state.theta.begin() + block.begin;
    if (block.count == 1)
      fmt::format_to(out, "  {}: {}\n", block.name, *begin);
    else
      fmt::format_to(out, "  {}: [{}]\n", block.name, fmt::join(begin, begin + block.count, ", "));
  }
  return text;
}

}  // namespace isochron
