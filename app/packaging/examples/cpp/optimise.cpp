// What `isochron run EXPERIMENT.yaml -o DIR` does, from C++:
//   optimise EXPERIMENT.yaml DIR [KEY=VALUE...]
#include <optim/experiment/experiment.h>
#include <optim/run/run.h>

#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: optimise EXPERIMENT.yaml DIR [KEY=VALUE...]\n");
    return 2;
  }
  try {
    const isochron::Experiment experiment = isochron::load_experiment(argv[1], {argv + 3, argv + argc});
    isochron::RunOptions options;
    options.folder = argv[2];
    options.progress = [](const isochron::Progress& progress) {
      std::printf("iteration %d: loss %g\n", progress.iteration, progress.loss);
    };
    std::printf("%s\n", isochron::name(isochron::start_run(experiment, options)));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
