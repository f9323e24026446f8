#include "optim/run/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/base/yaml_reader.h"
#include "optim/experiment/files.h"
#include "optim/run/bounds.h"
#include "optim/run/fit.h"

namespace isochron {
namespace {

std::string optional_number(double value) {
  return std::isnan(value) ? "null" : std::isinf(value) ? (value > 0 ? ".inf" : "-.inf") : exact(value);
}

/// A number, or a list of those of many components.
std::string numbers(const std::vector<double>& values, std::size_t begin, std::size_t count) {
  std::vector<std::string> list;
  for (std::size_t i = begin; i < begin + count; ++i) list.push_back(optional_number(values[i]));
  return count == 1 ? list[0] : fmt::format("[{}]", fmt::join(list, ", "));
}

/// Errors are in units of the parameters.
std::string errors_yaml(const Parameters& parameters, const ParameterErrors& errors) {
  std::string text;
  auto out = std::back_inserter(text);
  if (!errors.values.empty()) {
    fmt::format_to(out, "standard_errors_from: {}\nstandard_errors:\n", errors.from);
    for (const Parameters::Block& block : parameters.blocks())
      fmt::format_to(out, "  {}: {}\n", block.name, numbers(errors.values, block.begin, block.count));
  }
  if (errors.from.empty()) return text;
  std::vector<std::string> quoted;  // an index in brackets would be a list
  for (const std::string& name : errors.undetermined) quoted.push_back(fmt::format("\"{}\"", name));
  fmt::format_to(out, "undetermined: [{}]\n", fmt::join(quoted, ", "));
  if (!errors.steps_left.empty()) text += "steps_left:\n";
  for (const auto& [name, step] : errors.steps_left) fmt::format_to(out, "  \"{}\": {}\n", name, exact(step));
  if (!errors.combinations.empty()) text += "combinations:\n";
  for (const Combination& c : errors.combinations) {
    fmt::format_to(out, "  {}:\n    mean: {}\n    mean_standard_error: {}\n    values: {}\n", c.name,
                   optional_number(c.mean), optional_number(c.mean_error), numbers(c.values, 0, c.values.size()));
    if (!c.errors.empty()) fmt::format_to(out, "    standard_errors: {}\n", numbers(c.errors, 0, c.errors.size()));
  }
  return text;
}

}  // namespace

std::string summary_yaml(const LoopResult& result, const Checkpoint& state, const LogRow& last,
                         const Parameters& parameters, const RunCost& cost, const ParameterErrors& errors,
                         const std::optional<GoodnessOfFit>& fit) {
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
  text += fit_yaml(fit);
  text += bounds_yaml(find_at_bounds(parameters, state.theta));
  text += errors_yaml(parameters, errors);
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

bool has_ended(const std::string& file) {
  const auto text = read_file(file);
  return text && text->starts_with("status: ") &&
         !text->starts_with(fmt::format("status: {}\n", name(RunStatus::interrupted)));
}

std::vector<double> final_values(const std::string& file, const Parameters& parameters) {
  YamlMap values = open_yaml(file).map().require("parameters").map();
  std::vector<double> theta;
  for (const Parameters::Block& block : parameters.blocks()) {
    const YamlValue value = values.require(block.name);
    const std::vector<double> numbers = block.count == 1 ? std::vector{value.number()} : value.numbers();
    if (static_cast<int>(numbers.size()) != block.count) value.fail("is of another experiment");
    theta.insert(theta.end(), numbers.begin(), numbers.end());
  }
  return theta;
}

}  // namespace isochron
