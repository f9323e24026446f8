#include "app/experiment_source.h"

namespace isochron {

Experiment read_experiment(const ExperimentSource& source, bool target_values) {
  Experiment experiment = load_experiment(source.file, source.set, target_values);
  if (source.samples) experiment.samples.set_all(*source.samples);
  if (source.seed) experiment.seed = *source.seed;
  return experiment;
}

std::string output_folder(const std::string& output, const Experiment& experiment, const std::string& suffix) {
  return output.empty() ? "runs/" + experiment.name + suffix : output;
}

void start_at(const std::vector<double>& theta, const Parameters& parameters, Experiment& experiment) {
  for (std::size_t i = 0; i < experiment.parameters.size(); ++i) {
    const Parameters::Block& block = parameters.blocks()[i];
    experiment.parameters[i].initial.assign(theta.begin() + block.begin, theta.begin() + block.begin + block.count);
  }
}

}  // namespace isochron
