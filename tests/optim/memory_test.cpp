// Memory as it is estimated beforehand, against what evaluations take.
#include "optim/problem/memory.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

Problem large_problem(const TemporaryFolder& folder, const std::vector<std::string>& overrides) {
  write_tiny_scene(folder);
  folder.write("scene.yaml", replaced(folder.read("scene.yaml"), "[8, 8]", "[256, 256]"));
  std::vector<std::string> all{"gates.centers={start: 4, stop: 6, count: 64}",
                               "samples={primal: 2, interior: 1, visibility: 0, path_length: 0}", "target.samples=2"};
  all.insert(all.end(), overrides.begin(), overrides.end());
  return Problem(load_experiment(folder.write("large.yaml", tiny_experiment()), all));
}

double of_part(const Problem& problem, const std::string& what) {
  double sum = 0;
  for (const MemoryUse& part : run_memory(problem))
    if (part.what == what) sum += part.bytes;
  return sum;
}

/// 256 x 256 pixels and 64 gates.
constexpr double kImage = 8.0 * 256 * 256 * 64;

TEST(Memory, TablesOfGatesCountWhereLengthsAreDrawn) {
  const TemporaryFolder folder;
  const char* const what = "tables of gates";
  EXPECT_NEAR(of_part(large_problem(folder, {"estimator={sampling: ellipsoidal}"}), what), kImage, 0.02 * kImage);
  EXPECT_EQ(of_part(large_problem(folder, {"estimator={sampling: standard}"}), what), 0);
  // The ends of the bins are a term of their own, by connections.
  EXPECT_NEAR(of_part(large_problem(folder, {"estimator={sampling: standard}",
                                             "gates={kind: boxcar, centers: {start: "
                                             "4, stop: 6, count: 64}, width: 0.3}"}),
                      what),
              kImage, 0.02 * kImage);
  EXPECT_EQ(of_part(large_problem(folder, {"estimator={sampling: ellipsoidal}",
                                           "optimizer={method: levenberg_marquardt, iterations: 2}"}),
                    what),
            0);
}

double status(const std::string& key) {
  std::ifstream lines("/proc/self/status");
  for (std::string word; lines >> word;)
    if (double number = 0; word == key && lines >> number) return 1024 * number;
  return 0;
}

/// The peak of a target and a gradient stays below what is estimated for the run, which is not several times as much.
TEST(Memory, EstimatesHold) {
  for (const char* sampling : {"standard", "ellipsoidal"}) {
    const TemporaryFolder folder;
    const Problem problem = large_problem(folder, {std::string("estimator={sampling: ") + sampling + "}"});
    double estimated = 0;
    for (const MemoryUse& part : run_memory(problem)) estimated += part.bytes;
    std::ofstream("/proc/self/clear_refs") << 5;  // the peak counts from here
    const double before = status("VmRSS:");
    if (status("VmHWM:") > before + 0.1 * kImage) GTEST_SKIP() << "the system keeps the peak of what ran before";
    const GatedImage target = problem.make_target();
    problem.evaluate(problem.parameters().initial(), target, 0);
    const double peak = status("VmHWM:") - before;
    EXPECT_LT(peak, estimated) << sampling;
    EXPECT_GT(peak, 0.25 * estimated) << sampling;
  }
}

}  // namespace
}  // namespace isochron
