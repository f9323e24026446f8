#include "app/final_derivatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "core/base/clock.h"
#include "core/base/ranks.h"
#include "core/image/image.h"
#include "optim/experiment/files.h"
#include "optim/problem/estimates.h"
#include "optim/problem/memory.h"
#include "optim/run/levels.h"
#include "optim/run/summary.h"

namespace isochron {
namespace {

constexpr int kMostImages = 4;
constexpr double kSeconds = 2;
constexpr int kFewest = 2;  ///< samples that estimate_derivatives takes

/// Of each of the first parameters the unknown that moved most.
std::vector<int> chosen_unknowns(const Parameters& parameters, const std::vector<double>& theta) {
  std::vector<int> chosen;
  for (const Parameters::Block& block : parameters.blocks()) {
    if (static_cast<int>(chosen.size()) == kMostImages) break;
    int most = block.begin;
    const auto way = [&](int i) { return std::abs(theta[i] - parameters.initial()[i]); };
    for (int i = block.begin; i < block.begin + block.count; ++i)
      if (way(i) > way(most)) most = i;
    chosen.push_back(most);
  }
  return chosen;
}

/// Returns the seconds that it took.
double write_images(const Problem& problem, const std::vector<double>& theta, const std::vector<int>& unknowns,
                    const std::string& folder) {
  const Clock::time_point start = Clock::now();
  for (const int unknown : unknowns) {
    std::vector<std::string> names;
    std::vector<StoredImage> images;
    for (DerivativeEstimate& component : estimate_derivatives(problem, theta, unknown, 1)) {
      names.push_back(component.component);
      images.push_back(std::move(component.images[0]));
    }
    write_exr_components(folder + "/" + problem.parameters().component_names()[unknown] + ".exr", names, images,
                         exr_notes(problem.experiment().gates));
  }
  return seconds_since(start);
}

}  // namespace

void write_final_derivatives(const std::string& of_run) {
  if (rank_count() > 1) return;  // how many samples fit is up to a clock, and ranks have one each
  const std::string run = last_level_folder(of_run);
  const std::string summary = run + "/summary.yaml", folder = run + "/report/derivatives";
  const auto text = read_file(summary);
  if (!text || text->starts_with("status: interrupted")) return;
  const std::string of = fmt::format("summary: \"{}\"\n", checksum(*text));
  if (const auto known = read_file(folder + "/derivatives.yaml"); known && known->starts_with(of)) return;
  Problem problem(load_experiment(run + "/experiment.yaml"));
  problem.set_evaluations(1);
  const std::vector<double> theta = final_values(summary, problem.parameters());
  if (!problem.can_render(theta)) return;
  require_memory(problem, derivative_memory(problem, 1));
  std::filesystem::remove_all(folder);
  make_output_folder(folder);
  const std::vector<int> unknowns = chosen_unknowns(problem.parameters(), theta);
  const SampleSpec wanted = problem.experiment().samples;
  const int most = std::max({wanted.interior, wanted.visibility, wanted.path_length, wanted.primal});
  int samples = kFewest;
  SampleSpec few = wanted;
  few.set_all(samples);
  problem.set_samples(few);
  const double seconds = write_images(problem, theta, unknowns, folder);
  const int fitting = static_cast<int>(std::min<double>(most, samples * kSeconds / std::max(seconds, 1e-6)));
  if (fitting >= 2 * samples) {
    few.set_all(samples = fitting);
    problem.set_samples(few);
    write_images(problem, theta, unknowns, folder);
  }
  write_file_atomically(folder + "/derivatives.yaml", of + fmt::format("samples: {}\n", samples));
}

}  // namespace isochron
