// Experiment files.
#include "tests/fuzz/experiments.h"

using namespace isochron;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder = fuzz::folder_of_experiments();
  const std::string file = folder.write("experiment.yaml", data, size);
  fuzz::expect_result_or_input_error([&] { fuzz::check_experiment(folder, file); });
  return 0;
}
