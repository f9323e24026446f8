// Files of numbers that experiments name; compiled once for each use of one, which FUZZ_NUMBERS names.
#include "tests/fuzz/experiments.h"

using namespace isochron;

namespace {

std::string experiment_of(const std::string& use) {
  const std::string head = "name: n\nscene: scene.yaml\n";
  const std::string steady = head + "gates: {kind: steady}\nparameters:\n";
  if (use == "table")
    return head + "gates: {kind: tabulated, file: data.txt, centers: {start: 1, stop: 2, count: 3}}\n";
  if (use == "response")
    return head +
           "gates: {kind: bins, unit: ps, scene_unit_m: 1, start: -16, width: 16, count: 3, response: data.txt}\n";
  return steady +
         "  - {name: v, type: vertices, shape: quad, direction: free, initial: data.txt, target: data.txt}\n"
         "  - {name: a, type: albedo, shape: lamp, per: vertex, initial: data.txt, target: 0.5}\n";
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder = fuzz::folder_of_experiments();
  static const std::string file = folder.write("experiment.yaml", experiment_of(FUZZ_NUMBERS));
  folder.write("data.txt", data, size);
  fuzz::expect_result_or_input_error([&] { fuzz::check_experiment(folder, file); });
  return 0;
}
