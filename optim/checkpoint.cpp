#include "optim/checkpoint.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "core/math/error.h"
#include "optim/experiment.h"
#include "optim/files.h"

namespace isochron {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kChecksumKey = "checksum: ";

/// FNV-1a, 64 bits: finds torn and edited files, no protection against intent.
std::string checksum(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (unsigned char c : text) hash = (hash ^ c) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

std::string list(const std::vector<double>& values, std::size_t begin, std::size_t count) {
  const auto first = values.begin() + static_cast<std::ptrdiff_t>(begin);
  return fmt::format("[{}]", fmt::join(first, first + static_cast<std::ptrdiff_t>(count), ", "));
}

/// YAML writes special values with a dot; yaml-cpp reads them that way only.
std::string scalar(double value) {
  return std::isfinite(value) ? exact(value) : ".nan";
}

/// Raised inside this file when a checkpoint is not whole.
struct Damaged : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Checkpoint parse(const std::string& file, const std::string& text, const Parameters& parameters) {
  const std::size_t tail = text.rfind(kChecksumKey);
  if (tail == std::string::npos || text.substr(tail) != kChecksumKey + checksum(text.substr(0, tail)) + "\n")
    throw Damaged("checksum does not match");
  const YAML::Node root = YAML::Load(text);
  const std::string version = root["version"].as<std::string>();
  if (version != program_version())
    throw InputError(
        fmt::format("{}: version: written by {}; allowed: {}", file, version, program_version()));
  Checkpoint c;
  c.iteration = root["iteration"].as<int>();
  c.seconds = root["seconds"].as<double>();
  c.rejected = root["rejected"].as<int>();
  c.rejected_in_row = root["rejected_in_row"].as<int>();
  c.loss_initial = root["loss_initial"].as<double>();
  c.image_rmse_initial = root["image_rmse_initial"].as<double>();
  c.param_rmse_initial = root["param_rmse_initial"].as<double>();
  c.adam.steps = root["adam_steps"].as<long long>();
  const YAML::Node entries = root["parameters"];
  if (entries.size() != parameters.blocks().size())
    throw InputError(fmt::format("{}: parameters: {} there; the experiment has {}", file, entries.size(),
                                 parameters.blocks().size()));
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const YAML::Node entry = entries[i];
    const Parameters::Block& block = parameters.blocks()[i];
    const auto append = [&](const char* key, std::vector<double>& into) {
      const auto values = entry[key].as<std::vector<double>>();
      into.insert(into.end(), values.begin(), values.end());
      return static_cast<int>(values.size());
    };
    const std::string name = entry["name"].as<std::string>();
    const int count = append("value", c.theta);
    append("m", c.adam.m);
    append("v", c.adam.v);
    if (name != block.name || count != block.count)
      throw InputError(fmt::format("{}: parameters: '{}' with {} values; the experiment has '{}' with {}",
                                   file, name, count, block.name, block.count));
  }
  if (c.adam.m.size() != c.theta.size() || c.adam.v.size() != c.theta.size())
    throw Damaged("values are missing");
  return c;
}

}  // namespace

Checkpoint::Checkpoint()
    : loss_initial(kUnknown), image_rmse_initial(kUnknown), param_rmse_initial(kUnknown) {}

void save_checkpoint(const std::string& folder, const Checkpoint& c, const Parameters& parameters) {
  AdamState adam = c.adam;
  adam.m.resize(c.theta.size(), 0.0);
  adam.v.resize(c.theta.size(), 0.0);
  std::string text = fmt::format(
      "version: {}\niteration: {}\nseconds: {}\nrejected: {}\nrejected_in_row: {}\nloss_initial: {}\n"
      "image_rmse_initial: {}\nparam_rmse_initial: {}\nadam_steps: {}\nparameters:{}\n",
      program_version(), c.iteration, scalar(c.seconds), c.rejected, c.rejected_in_row,
      scalar(c.loss_initial), scalar(c.image_rmse_initial), scalar(c.param_rmse_initial), adam.steps,
      parameters.blocks().empty() ? " []" : "");
  for (const Parameters::Block& block : parameters.blocks())
    text += fmt::format("  - name: {}\n    value: {}\n    m: {}\n    v: {}\n", block.name,
                        list(c.theta, block.begin, block.count), list(adam.m, block.begin, block.count),
                        list(adam.v, block.begin, block.count));
  text += kChecksumKey + checksum(text) + "\n";
  const std::string latest = folder + "/checkpoint.yaml", previous = folder + "/checkpoint.previous.yaml";
  const std::string fresh = folder + "/checkpoint.new.yaml";
  write_file_atomically(fresh, text);
  // Between the two renames only `previous` exists, which load_checkpoint accepts.
  if (std::filesystem::exists(latest)) std::filesystem::rename(latest, previous);
  std::filesystem::rename(fresh, latest);
}

std::optional<Checkpoint> load_checkpoint(const std::string& folder, const Parameters& parameters,
                                          std::string* warning) {
  std::string problems;
  for (const char* name : {"checkpoint.yaml", "checkpoint.previous.yaml"}) {
    const std::string file = folder + "/" + name;
    if (!std::filesystem::exists(file)) continue;
    const auto text = read_file(file);
    try {
      if (!text) throw Damaged("cannot be read");
      Checkpoint checkpoint = parse(file, *text, parameters);
      if (!problems.empty()) {
        // The next save moves the latest over the one before: a damaged file must not replace a whole one.
        std::filesystem::remove(folder + "/checkpoint.yaml");
        if (warning) *warning = problems + "; going on from " + file;
      }
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
