// What many time bins cost: `render` and `derive` of a cube of 64 x 64 pixels and 1000 bins beside those of 10 bins, in processor
// time and in memory.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <limits>

#include "program.h"

namespace isochron {
namespace {

struct Usage {
  double seconds = std::numeric_limits<double>::infinity();  ///< of processors, in all; the least of several runs
  double bytes = 0;                                          ///< peak
};

class Cost : public Program {
 protected:
  Cost() {
    folder_.write("scene.yaml", replaced(folder_.read("scene.yaml"), "[8, 8]", "[128, 128]"));
    for (const int bins : {10, 1000})
      folder_.write("bins" + std::to_string(bins) + ".yaml",
                    replaced(replaced(replaced(tiny_experiment(), "{kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}",
                                               "{kind: bins, start: 3, width: " + std::to_string(5.0 / bins) +
                                                   ", count: " + std::to_string(bins) + "}"),
                                      "visibility: 16, path_length: 0", "visibility: 16, path_length: 16"),
                             "max_bounces: 2", "max_bounces: 1"));
    // So many samples that paths take most of what few bins take, not files.
    for (const char* name : {"bins10.yaml", "bins1000.yaml"})
      folder_.write(name, replaced(folder_.read(name), "primal: 16,", "primal: 128,"));
  }

  Usage measure(const std::string& command, int bins) {
    constexpr int kRuns = 3;
    Usage usage;
    for (int i = 0; i < kRuns; ++i) {
      rusage before{}, after{};
      getrusage(RUSAGE_CHILDREN, &before);
      const Result result = run({command, folder_.file("bins" + std::to_string(bins) + ".yaml"), "-o",
                                 folder_.file("out"), "--no-plots", "--quiet", "--threads", "1"});
      getrusage(RUSAGE_CHILDREN, &after);
      EXPECT_EQ(result.status, 0) << result.errors;
      const auto seconds = [](const rusage& r) {
        return static_cast<double>(r.ru_utime.tv_sec + r.ru_stime.tv_sec) +
               1e-6 * static_cast<double>(r.ru_utime.tv_usec + r.ru_stime.tv_usec);
      };
      usage.seconds = std::min(usage.seconds, seconds(after) - seconds(before));
      usage.bytes = 1024.0 * static_cast<double>(after.ru_maxrss);  // of the largest so far: few bins go first
    }
    return usage;
  }
};

constexpr double kImage = 4.0 * 128 * 128 * 1000;  ///< in single precision

// Paths of this scene take so little that what they add to an image beyond the caches shows: 1.3 times where it was measured, and
// more where memory is slower. scripts/cube_cost.py measures a larger cube.
TEST_F(Cost, RenderOfAThousandBins) {
  const Usage few = measure("render", 10), many = measure("render", 1000);
  EXPECT_LT(many.seconds, 2 * few.seconds);
  EXPECT_LT(many.bytes, few.bytes + 3 * kImage);
}

TEST_F(Cost, DeriveOfAThousandBins) {
  const Usage few = measure("derive", 10), many = measure("derive", 1000);
  EXPECT_LT(many.seconds, 2 * few.seconds);
  EXPECT_LT(many.bytes, few.bytes + 3 * kImage);
}

}  // namespace
}  // namespace isochron
