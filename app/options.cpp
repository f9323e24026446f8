#include "app/options.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <thread>

#include "core/base/error.h"
#include "core/base/parallel.h"

namespace isochron {

void add_session_options(CLI::App& command, CommonOptions& options) {
  command.add_option("--threads", options.threads, "threads; 0: all cores. Results do not depend on it")
      ->check(CLI::Range(0, 4096))
      ->type_name("N");
  command.add_flag("--quiet", options.quiet, "only warnings and errors");
  command.add_flag("--no-plots", options.no_plots, "write no PNG and no report");
}

void add_experiment_options(CLI::App& command, CommonOptions& options) {
  const std::string folder_help =
      fmt::format("output folder; default runs/NAME{}", command.get_name() == "run" ? "" : "-" + command.get_name());
  command.add_option("experiment", options.file, "experiment file")->required()->type_name("EXPERIMENT.yaml");
  command.add_option("-o,--output", options.output, folder_help)->type_name("DIR");
  command
      .add_option("--at", options.at,
                  "values of the parameters: initial (default), target, or NAME=VALUE[,NAME=VALUE...] with "
                  "the others "
                  "initial")
      ->type_name("POINT");
  command.add_option("--samples", options.samples, "samples per pixel, for every term that is not left out")
      ->check(CLI::Range(1, 1 << 30))
      ->type_name("N");
  add_seed_option(command, options.seed);
  command
      .add_option("--set", options.set,
                  "replace a value of the experiment file, such as optimizer.iterations=10 or "
                  "parameters[0].initial=0.2; KEY.PATH= with nothing behind it removes the key; may be repeated")
      ->type_name("KEY.PATH=VALUE")
      ->expected(1)
      ->take_all()
      ->allow_extra_args(false);
  add_session_options(command, options);
}

CLI::Validator whole_number(std::int64_t low, std::int64_t high) {
  const auto check = [=](const std::string& text) -> std::string {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool is_one = error == std::errc() && end == text.data() + text.size();
    return is_one && value >= low && value <= high
               ? ""
               : fmt::format("{} is no whole number from {} to {}", text, low, high);
  };
  return {check, fmt::format("INT in [{} - {}]", low, high)};
}

namespace {

CLI::Validator number_check(const std::function<bool(double)>& holds, const std::string& allowed,
                            const std::string& name) {
  const auto check = [=](const std::string& text) -> std::string {
    double value = 0;
    const bool is_one = CLI::detail::lexical_cast(text, value) && std::isfinite(value);
    return is_one && holds(value) ? "" : fmt::format("{} is no number {}", text, allowed);
  };
  return {check, name};
}

}  // namespace

CLI::Validator number(double low, double high) {
  return number_check([=](double value) { return value >= low && value <= high; },
                      fmt::format("from {} to {}", low, high), fmt::format("FLOAT in [{} - {}]", low, high));
}

CLI::Validator positive_number() {
  return number_check([](double value) { return value > 0; }, "above 0", "POSITIVE");
}

void begin_session(const CommonOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::warn);
  set_thread_count(options.threads);
}

void warn(const std::string& text) {
  spdlog::warn("{}", text);
}

void add_parameter_option(CLI::App& command, CommonOptions& options) {
  command.add_option("--parameter", options.parameter, "only this parameter (NAME or NAME[INDEX]); default all")
      ->type_name("NAME");
}

void add_force_option(CLI::App& command, CommonOptions& options) {
  command.add_flag("--force", options.force,
                   "overwrite the run that the folder holds (else it is moved to DIR.1, DIR.2, ...)");
}

Parameters::Block chosen_parameter(const Parameters& parameters, const std::string& name) {
  return name.empty() ? Parameters::Block{"", 0, parameters.size()} : parameters.find(name, "--parameter");
}

void say_written(const std::string& folder, const std::vector<std::string>& files) {
  constexpr std::size_t kMostNamed = 16;
  if (files.size() <= kMostNamed)
    spdlog::info("wrote into {}: {}", folder, fmt::join(files, ", "));
  else
    spdlog::info("wrote {} files into {}: {} to {}", files.size(), folder, files.front(), files.back());
}

int thread_count(const CommonOptions& options) {
  return options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
}

}  // namespace isochron
