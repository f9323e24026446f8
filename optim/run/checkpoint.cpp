#include "optim/run/checkpoint.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/ranks.h"
#include "optim/experiment/experiment.h"
#include "optim/experiment/files.h"

namespace isochron {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kChecksumKey = "checksum: ";

std::string list(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

/// YAML writes special values with a dot; yaml-cpp reads them that way only.
std::string scalar(double value) {
  return std::isfinite(value) ? exact(value) : std::isnan(value) ? ".nan" : value > 0 ? ".inf" : "-.inf";
}

/// Raised inside this file when a checkpoint is not whole.
struct Damaged : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<std::pair<const char*, std::vector<double>*>> lists_of(SafeguardState& state) {
  return {{"recent", &state.recent},
          {"recent_noise", &state.recent_noise},
          {"best_theta", &state.best_theta},
          {"block", &state.block},
          {"block_before", &state.block_before},
          {"theta_sum", &state.theta_sum},
          {"gradient_sum", &state.gradient_sum},
          {"gradient_squares", &state.gradient_squares}};
}

std::vector<std::pair<const char*, std::vector<double>*>> lists_of(DescentState& state) {
  return {{"first", &state.first},
          {"first_noise", &state.first_noise},
          {"recent", &state.recent},
          {"recent_noise", &state.recent_noise},
          {"theta_sum", &state.theta_sum}};
}

/// `note` receives what the user may want to know of the file.
Checkpoint parse(const std::string& file, const std::string& text, const Parameters& parameters, std::string& note) {
  const std::size_t tail = text.rfind(kChecksumKey);
  if (tail == std::string::npos ||
      text.substr(tail) != kChecksumKey + checksum(std::string_view(text).substr(0, tail)) + "\n")
    throw Damaged("checksum does not match");
  const YAML::Node root = YAML::Load(text);
  const YAML::Node schema = root["schema"];
  const std::string version = root["version"].as<std::string>();
  if (!schema || schema.as<int>() != kCheckpointSchema)
    throw InputError(fmt::format("{}: schema: {}, written by isochron {} (allowed: {})", file,
                                 schema ? schema.as<std::string>() : "is missing", version, kCheckpointSchema));
  if (version != program_version())
    note = fmt::format("{}: written by isochron {}; the result may differ from a run of one version", file, version);
  Checkpoint c;
  c.iteration = root["iteration"].as<int>();
  c.seconds = root["seconds"].as<double>();
  c.loss_initial = root["loss_initial"].as<double>();
  c.loss_noise_initial = root["loss_noise_initial"].as<double>();
  c.image_rmse_initial = root["image_rmse_initial"].as<double>();
  c.param_rmse_initial = root["param_rmse_initial"].as<double>();
  const YAML::Node entries = root["parameters"];
  if (entries.size() != parameters.blocks().size())
    throw InputError(fmt::format("{}: parameters: {} there; the experiment has {}", file, entries.size(),
                                 parameters.blocks().size()));
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const YAML::Node entry = entries[i];
    const Parameters::Block& block = parameters.blocks()[i];
    const std::string name = entry["name"].as<std::string>();
    const auto values = entry["value"].as<std::vector<double>>();
    const int count = static_cast<int>(values.size());
    c.theta.insert(c.theta.end(), values.begin(), values.end());
    if (name != block.name || count != block.count)
      throw InputError(fmt::format("{}: parameters: '{}' with {} values; the experiment has '{}' with {}", file, name,
                                   count, block.name, block.count));
  }
  for (const auto& entry : root["optimizer"])
    c.optimizer[entry.first.as<std::string>()] = entry.second.as<std::vector<double>>();
  const YAML::Node safeguard = root["safeguard"];
  c.safeguard.rate = safeguard["rate"].as<double>();
  c.safeguard.rejected = safeguard["rejected"].as<int>();
  c.safeguard.rejected_in_row = safeguard["rejected_in_row"].as<int>();
  c.safeguard.best_level = safeguard["best_level"].as<double>();
  c.safeguard.best_noise = safeguard["best_noise"].as<double>();
  for (const auto& [key, values] : lists_of(c.safeguard)) *values = safeguard[key].as<std::vector<double>>();
  const YAML::Node descent = root["descent"];
  c.descent.judged = descent["judged"].as<bool>();
  c.descent.summed = descent["summed"].as<int>();
  for (const auto& [key, values] : lists_of(c.descent)) *values = descent[key].as<std::vector<double>>();
  c.steps_rejected = root["steps_rejected"].as<int>();
  c.steps_rejected_in_row = root["steps_rejected_in_row"].as<int>();
  return c;
}

}  // namespace

Checkpoint::Checkpoint()
    : loss_initial(kUnknown),
      loss_noise_initial(kUnknown),
      image_rmse_initial(kUnknown),
      param_rmse_initial(kUnknown) {}

void save_checkpoint(const std::string& folder, const Checkpoint& c, const Parameters& parameters) {
  std::string text = fmt::format(
      "schema: {}\nversion: {}\niteration: {}\nseconds: {}\nloss_initial: {}\nloss_noise_initial: "
      "{}\nimage_rmse_initial: "
      "{}\nparam_rmse_initial: {}\n"
      "parameters:{}\n",
      kCheckpointSchema, program_version(), c.iteration, scalar(c.seconds), scalar(c.loss_initial),
      scalar(c.loss_noise_initial), scalar(c.image_rmse_initial), scalar(c.param_rmse_initial),
      parameters.blocks().empty() ? " []" : "");
  auto out = std::back_inserter(text);
  for (const Parameters::Block& block : parameters.blocks()) {
    const auto begin = c.theta.begin() + block.begin;
    fmt::format_to(out, "  - name: {}\n    value: [{}]\n", block.name, fmt::join(begin, begin + block.count, ", "));
  }
  text += c.optimizer.empty() ? "optimizer: {}\n" : "optimizer:\n";
  for (const auto& [key, values] : c.optimizer) fmt::format_to(out, "  {}: {}\n", key, list(values));
  SafeguardState safeguard = c.safeguard;
  fmt::format_to(out,
                 "safeguard:\n  rate: {}\n  rejected: {}\n  rejected_in_row: {}\n  best_level: {}\n  best_noise: {}\n",
                 scalar(safeguard.rate), safeguard.rejected, safeguard.rejected_in_row, scalar(safeguard.best_level),
                 scalar(safeguard.best_noise));
  for (const auto& [key, values] : lists_of(safeguard)) fmt::format_to(out, "  {}: {}\n", key, list(*values));
  DescentState descent = c.descent;
  fmt::format_to(out, "descent:\n  judged: {}\n  summed: {}\n", descent.judged, descent.summed);
  for (const auto& [key, values] : lists_of(descent)) fmt::format_to(out, "  {}: {}\n", key, list(*values));
  fmt::format_to(out, "steps_rejected: {}\nsteps_rejected_in_row: {}\n", c.steps_rejected, c.steps_rejected_in_row);
  text += kChecksumKey + checksum(text) + "\n";
  const std::string latest = folder + "/checkpoint.yaml", previous = folder + "/checkpoint.previous.yaml";
  const std::string fresh = folder + "/checkpoint.new.yaml";
  write_file_atomically(fresh, text);
  // Between the two renames only `previous` exists, which load_checkpoint accepts.
  on_first_rank([&] {
    if (std::filesystem::exists(latest)) std::filesystem::rename(latest, previous);
    std::filesystem::rename(fresh, latest);
  });
}

std::optional<Checkpoint> load_checkpoint(const std::string& folder, const Parameters& parameters,
                                          std::string* warning) {
  std::string problems;
  for (const char* name : {"checkpoint.yaml", "checkpoint.previous.yaml"}) {
    const std::string file = folder + "/" + name;
    if (!file_exists(file)) continue;
    const auto text = read_file(file);
    try {
      if (!text) throw Damaged("cannot be read");
      std::string note;
      Checkpoint checkpoint = parse(file, *text, parameters, note);
      if (!problems.empty()) {
        // The next save moves the latest over the one before: a damaged file must not replace a whole one.
        on_first_rank([&] { std::filesystem::remove(folder + "/checkpoint.yaml"); });
        note = problems + "; continuing from " + (note.empty() ? file : note);
      }
      if (warning) *warning = note;
      return checkpoint;
    } catch (const Damaged& error) {
      problems += fmt::format("{}{}: damaged: {}", problems.empty() ? "" : "; ", file, error.what());
    } catch (const YAML::Exception& error) {
      problems += fmt::format("{}{}: damaged: {}", problems.empty() ? "" : "; ", file, error.msg);
    }
  }
  if (!problems.empty()) throw InputError(problems);
  return std::nullopt;
}

}  // namespace isochron
