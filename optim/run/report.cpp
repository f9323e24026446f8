#include "optim/run/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <iterator>

#include "optim/run/bounds.h"
#include "optim/run/fit.h"

namespace isochron {
namespace {

constexpr int kMostRows = 3;

/// Standard errors by which a loss has to have risen before it is said.
constexpr double kClearly = 5;

struct Row {
  std::string name;
  double initial, found, target, error, initial_error;  ///< NaN: unknown
};

double root_mean_square(const std::vector<double>& values, const Parameters::Block& block) {
  double sum = 0;
  for (int i = block.begin; i < block.begin + block.count; ++i) sum += values[i] * values[i];
  return std::sqrt(sum / block.count);
}

std::vector<Row> rows_of(const Parameters& parameters, const std::vector<double>& theta) {
  const std::vector<double>&initial = parameters.initial(), &target = parameters.target();
  std::vector<double> error(theta.size()), initial_error(theta.size());
  for (std::size_t i = 0; i < theta.size(); ++i) {
    error[i] = theta[i] - target[i];
    initial_error[i] = initial[i] - target[i];
  }
  std::vector<Row> rows;
  for (const Parameters::Block& block : parameters.blocks()) {
    if (block.count > kMostRows) {
      const auto rms = [&](const std::vector<double>& values) { return root_mean_square(values, block); };
      rows.push_back({fmt::format("{} (rms of {})", block.name, block.count), rms(initial), rms(theta), rms(target),
                      rms(error), rms(initial_error)});
      continue;
    }
    for (int i = block.begin; i < block.begin + block.count; ++i)
      rows.push_back({parameters.component_names()[i], initial[i], theta[i], target[i], error[i], initial_error[i]});
  }
  return rows;
}

std::string table(const std::vector<Row>& rows) {
  std::size_t width = std::string("parameter").size();
  for (const Row& row : rows) width = std::max(width, row.name.size());
  const auto number = [](double value) { return std::isnan(value) ? std::string("-") : fmt::format("{:.5g}", value); };
  std::string text;
  const auto line = [&](const std::string& name, const std::array<std::string, 5>& cells) {
    text += fmt::format("  {:<{}}", name, width);
    for (const std::string& cell : cells) text += fmt::format("  {:>13}", cell);
    text += "\n";
  };
  line("parameter", {"initial", "found", "target", "error", "initial error"});
  for (const Row& row : rows)
    line(row.name,
         {number(row.initial), number(row.found), number(row.target), number(row.error), number(row.initial_error)});
  return text;
}

/// The first of some names.
std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  const std::string rest = names.size() > kMost ? fmt::format(" and {} more", names.size() - kMost) : "";
  return fmt::format("{}{}", fmt::join(names.begin(), names.begin() + std::min(kMost, names.size()), ", "), rest);
}

std::string what_errors_say(const ParameterErrors& errors) {
  std::string text;
  if (!errors.undetermined.empty())
    text += fmt::format("  the readings do not determine {}\n", some_of(errors.undetermined));
  for (const Combination& c : errors.combinations)
    text += fmt::format("  {} is {:.5g}{}{}\n", c.name, c.mean,
                        std::isfinite(c.mean_error) ? fmt::format(" +- {:.2g}", c.mean_error) : "",
                        c.values.size() > 1 ? fmt::format(" (mean of {})", c.values.size()) : "");
  std::vector<std::string> steps;
  for (const auto& [name, step] : errors.steps_left) steps.push_back(fmt::format("{} by {:.2g}", name, step));
  if (!steps.empty())
    text += fmt::format("  not at the minimum: a Newton step would move {}: more than the standard errors\n",
                        some_of(steps));
  return text;
}

}  // namespace

std::string run_report(const LoopResult& result, const Checkpoint& state, const LogRow& last,
                       const Parameters& parameters, const ParameterErrors& errors,
                       const std::optional<GoodnessOfFit>& fit) {
  const int rejected = state.safeguard.rejected + state.steps_rejected;
  std::string text = fmt::format("{} after {} iterations, {:.3g} s{}; final parameters: {} (row {} of log.csv)\n",
                                 name(result.status), state.iteration, std::max(state.seconds, last.seconds),
                                 rejected > 0 ? fmt::format(", {} steps rejected", rejected) : "", name(result.choice),
                                 last.iteration);
  text += table(rows_of(parameters, state.theta)) + bounds_report(find_at_bounds(parameters, state.theta)) +
          what_errors_say(errors);
  text += fit_report(fit);
  auto out = std::back_inserter(text);
  if (!std::isnan(last.loss)) {
    fmt::format_to(out, "  loss {:.3g} +- {:.2g} (at the start {:.3g} +- {:.2g}){}\n", last.loss, last.loss_noise,
                   state.loss_initial, state.loss_noise_initial,
                   last.loss > state.loss_initial + kClearly * std::hypot(last.loss_noise, state.loss_noise_initial)
                       ? ": it has risen; try shorter steps"
                   : last.loss >= 2 * last.loss_noise ? ""
                   : state.loss_initial < 2 * state.loss_noise_initial
                       ? ": it cannot be told from 0, nor could it at the start"
                       : ": it cannot be told from 0");
    const LossSpread spread = loss_spread(state.descent);
    if (!std::isnan(spread.noise_share))
      fmt::format_to(out, "  noise makes {:.0f} % of the loss's variance over the {} rows of log.csv up to row {}\n",
                     100 * spread.noise_share, spread.rows, state.iteration);
    const auto rmse = [](double value) { return value > 0 ? fmt::format("{:.3g}", value) : "below the noise"; };
    fmt::format_to(out, "  image RMSE {} (at the start {})\n", rmse(last.image_rmse), rmse(state.image_rmse_initial));
  }
  return text;
}

std::string files_to_look_at(const std::string& folder, bool plots) {
  const auto present = [&](std::initializer_list<const char*> names) {
    std::string text;
    for (const char* name : names)
      if (std::filesystem::exists(std::filesystem::path(folder) / name))
        text += (text.empty() ? "" : ", ") + std::string(name);
    return text;
  };
  std::string text;
  const auto line = [&](const std::string& names, const char* what) {
    if (!names.empty()) text += fmt::format("    {}: {}\n", what, names);
  };
  if (plots) line(present({"report.html"}), "page");
  line(present({"summary.yaml", "log.csv", "final.exr", "final.h5", "target.exr", "initial.exr"}), "results");
  line(present({"geometry/"}), "meshes");
  if (plots)
    line(present({"surface.png", "capture.png", "final.png", "target.png", "initial.png", "residual.png", "rmse.png"}),
         "pictures");
  line(present({"frames/", "report/"}), "behind the page");
  line(present({"experiment.yaml", "inputs/", "checkpoint.yaml", "checkpoint.previous.yaml"}), "to resume");
  return text.empty() ? text : fmt::format("  {}\n{}", folder, text);
}

}  // namespace isochron
