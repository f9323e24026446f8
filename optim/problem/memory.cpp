#include "optim/problem/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "core/base/error.h"
#include "core/base/ranks.h"
#include "core/films/sinks.h"
#include "core/techniques/gate_pick.h"
#include "optim/problem/estimates.h"
#include "optim/problem/jacobian.h"

namespace isochron {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Copies of an image's size that sums of work partitions take at a time: one for every thread and those that wait for
/// others to be added (core/base/partition_sum.h). With more than a few threads they may be more, with few samples, which
/// touch a part of the image alone, less.
constexpr double kPartialSums = 8;

/// The number that follows `key` in a file of `KEY: NUMBER kB` lines, in bytes; none: infinite.
double kilobytes(const char* file, const std::string& key) {
  std::ifstream lines(file);
  for (std::string word; lines >> word;)
    if (double number = 0; word == key && lines >> number) return 1024 * number;
  return kUnlimited;
}

double first_number(const std::string& file) {
  double number = 0;
  return std::ifstream(file) >> number ? number : kUnlimited;
}

/// Of the process's control group; "max" where there is no limit.
double group_memory() {
  std::ifstream groups("/proc/self/cgroup");
  double least = kUnlimited;
  for (std::string line; std::getline(groups, line);) {
    const std::size_t at = line.rfind(':');
    const std::string group = line.substr(at + 1);
    // Version 2 has one line, 0::/group; in a container the group's files are at the root. Version 1: N:memory:/group.
    for (const std::string& folder : {"/sys/fs/cgroup" + group, std::string("/sys/fs/cgroup")})
      least = std::min(least, first_number(folder + "/memory.max") - first_number(folder + "/memory.current"));
    if (line.find(":memory:") == std::string::npos) continue;
    for (const std::string& folder : {"/sys/fs/cgroup/memory" + group, std::string("/sys/fs/cgroup/memory")})
      least = std::min(
          least, first_number(folder + "/memory.limit_in_bytes") - first_number(folder + "/memory.usage_in_bytes"));
  }
  return std::isnan(least) ? kUnlimited : least;
}

double limit(int resource, const std::string& used) {
  rlimit most{};
  if (getrlimit(static_cast<__rlimit_resource>(resource), &most) != 0 || most.rlim_cur == RLIM_INFINITY)
    return kUnlimited;
  return static_cast<double>(most.rlim_cur) - kilobytes("/proc/self/status", used);
}

/// In double precision.
double image_bytes(const Problem& problem) {
  return sizeof(double) * residual_count(problem);
}

/// As results are kept.
double stored_bytes(const Problem& problem) {
  return sizeof(float) * residual_count(problem);
}

/// What samples bring of an image's values, as lists (core/base/listed_sum.h), of so many per pixel; `copies` of the image at
/// most.
double listed_bytes(const Problem& problem, int samples, double copies) {
  constexpr double kEntry = 16, kEntriesPerVertex = 2;
  const GateSet& gates = problem.gates();
  int of_a_length = 0;
  gates.for_each_value(gates.center(gates.size() / 2), [&](int, double) { ++of_a_length; });
  const double entries = residual_count(problem) / gates.size() * samples * kEntriesPerVertex *
                         (problem.experiment().estimator.max_bounces + 1) * std::max(of_a_length, 1);
  return std::min(copies * image_bytes(problem), kEntry * entries);
}

/// Standard sampling shares one image; what automatic sampling settles on is not known before its trial.
bool shares_one_image(const Problem& problem) {
  const Experiment& experiment = problem.experiment();
  return experiment.estimator.sampling == Sampling::standard || experiment.gates.unbounded();
}

/// Whether gradients may draw lengths from the gates, each pixel with probabilities of its own.
bool draws_lengths(const Problem& problem) {
  return !shares_one_image(problem) || problem.gates().shape().pair_mass(PairPart::dirac) > 0;
}

std::string amount(double bytes) {
  return bytes >= 1e9 ? fmt::format("{:.3g} GB", bytes / 1e9) : fmt::format("{:.0f} MB", std::ceil(bytes / 1e6));
}

/// Of what partitions of work add up at a time: as large as all that they bring, and in part once more as they are added.
double partial_bytes(const Problem& problem, int samples) {
  return 2 * listed_bytes(problem, samples, kPartialSums / 2);
}

}  // namespace

double available_memory() {
  const double shared = std::min(kilobytes("/proc/meminfo", "MemAvailable:"), group_memory()) / rank_count_here();
  const std::vector<double> available =
      of_all_ranks(std::min({shared, limit(RLIMIT_AS, "VmSize:"), limit(RLIMIT_DATA, "VmData:")}));
  return *std::min_element(available.begin(), available.end());
}

std::vector<MemoryUse> image_memory(const Problem& problem) {
  constexpr double kWithFile = 1.5;
  const int samples = problem.experiment().samples.primal;
  std::vector<MemoryUse> parts = {{"images and their file", kWithFile * stored_bytes(problem)}};
  if (!shares_one_image(problem))
    parts.push_back({"images of work partitions",
                     partial_bytes(problem, samples) + listed_bytes(problem, samples, kMostReplicates)});
  return parts;
}

std::vector<MemoryUse> derivative_memory(const Problem& problem, int columns) {
  constexpr int kComponents = 4;
  const Experiment& experiment = problem.experiment();
  if (problem.by_differences()) return difference_memory(problem, kMostReplicates * columns);
  const int samples =
      std::max({experiment.samples.interior, experiment.samples.visibility, experiment.samples.path_length});
  return {{fmt::format("derivative images of {} unknown{}", columns, columns == 1 ? "" : "s"),
           kComponents * stored_bytes(problem) * columns},
          {"derivative images of work partitions",
           (partial_bytes(problem, samples) + listed_bytes(problem, samples, kMostReplicates)) * columns}};
}

std::vector<MemoryUse> difference_memory(const Problem& problem, int images) {
  constexpr int kAtATime = 4;
  return {{"finite differences", (images + kAtATime) * image_bytes(problem)},
          {"images of work partitions", partial_bytes(problem, problem.experiment().samples.primal)}};
}

std::vector<MemoryUse> run_memory(const Problem& problem) {
  const Experiment& experiment = problem.experiment();
  const double image = image_bytes(problem), unknowns = problem.parameters().size();
  std::vector<MemoryUse> parts = {{"images, their mean and their file", 4.5 * image},
                                  {"target, residual and adjoint images", 3 * image}};
  if (!shares_one_image(problem))
    parts.push_back({"images of work partitions",
                     partial_bytes(problem, std::max(experiment.samples.primal, experiment.target.samples))});
  const OptimizerMethod method = experiment.optimizer.method;
  if (method == OptimizerMethod::quasi_newton) {
    parts.push_back({"images of a line search", 3 * image});
    parts.push_back({"images of probes", kAdjointsTogether * image});
  }
  if (method != OptimizerMethod::levenberg_marquardt) {
    const Camera& camera = problem.scene().camera;
    if (draws_lengths(problem))
      parts.push_back({"tables of gates", GatePick::table_bytes(camera.width * camera.height, problem.gates().size())});
    return parts;
  }
  parts.push_back(
      {fmt::format("two halves of the Jacobian of {:.0f} residuals by {:.0f} unknowns", image / 8, unknowns),
       2 * image * unknowns});
  parts.push_back(
      {"derivative images of an unknown",
       2 * image + partial_bytes(problem, std::max(experiment.samples.interior, experiment.samples.visibility))});
  return parts;
}

void require_memory(const Problem& problem, const std::vector<MemoryUse>& parts, double available) {
  double sum = 0;
  std::string list;
  for (const MemoryUse& part : parts) {
    sum += part.bytes;
    list += fmt::format("{}{} {}", list.empty() ? "" : ", ", part.what, amount(part.bytes));
  }
  if (sum <= available) return;
  const Camera& camera = problem.scene().camera;
  const int channels = problem.scene().grey ? 1 : 3;
  throw InputError(
      fmt::format("{}: needs about {} of memory for {} x {} pixels, {} gate{} and {} channel{} ({}); {} are "
                  "available: lower resolution or the number of gates",
                  problem.experiment().file, amount(sum), camera.width, camera.height, problem.gates().size(),
                  problem.gates().size() == 1 ? "" : "s", channels, channels == 1 ? "" : "s", list,
                  amount(std::max(0.0, available))));
}

void require_memory(const MemoryUse& part, const std::string& advice, double available) {
  if (part.bytes > available)
    throw InputError(fmt::format("{} {} of memory; {} are available: {}", part.what, amount(part.bytes),
                                 amount(std::max(0.0, available)), advice));
}

}  // namespace isochron
