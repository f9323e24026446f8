// How runs end: stopped at any row and resumed, over what other runs have left, and longer than they were to be.
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "core/base/progress.h"
#include "optim/problem/darkness.h"
#include "optim/run/run.h"
#include "tests/optim/temporary_folder.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

class RunEnd : public testing::Test {
 protected:
  RunEnd() { write_tiny_scene(folder_); }
  ~RunEnd() override { clear_stop_request(); }

  Experiment tiny(const std::vector<std::string>& more) const {
    return load_experiment(folder_.write("tiny.yaml", tiny_experiment()), more);
  }
  RunOptions options(const std::string& out) const {
    RunOptions options;
    options.folder = folder_.file(out);
    return options;
  }
  std::vector<std::string> lines(const std::string& file) const {
    std::istringstream text(folder_.read(file));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  /// The log but for its times, and the parameters of the summary.
  std::vector<std::string> found(const std::string& out) const {
    std::vector<std::string> result;
    for (const std::string& line : lines(out + "/log.csv")) {
      const std::size_t first = line.find(','), second = line.find(',', first + 1);
      result.push_back(line.substr(0, first) + line.substr(second));
    }
    bool parameters = false;
    for (const std::string& line : lines(out + "/summary.yaml")) {
      parameters = line == "parameters:" || (parameters && line.starts_with("  "));
      if (parameters || line.starts_with("status") || line.starts_with("final:")) result.push_back(line);
    }
    return result;
  }

  TemporaryFolder folder_;
};

/// The last row may be of an average, after which errors are found and pictures written: a stop there leaves the checkpoint of the last
/// iteration, not the average as if it went on from that.
TEST_F(RunEnd, StoppedAtAnyRowAndResumedFindsTheSame) {
  const std::vector<std::vector<std::string>> all = {
      {"optimizer={method: lbfgs, iterations: 5}"},
      {"optimizer={method: levenberg_marquardt, iterations: 5}"},
      {"optimizer={method: adam, learning_rate: 0.005, iterations: 40, stop: {window: 5}}"}};
  for (const auto& set : all) {
    SCOPED_TRACE(set[0]);
    std::filesystem::remove_all(folder_.file("whole"));
    start_run(tiny(set), options("whole"));
    const auto whole = found("whole");
    EXPECT_NE(std::find(whole.begin(), whole.end(), "final: average"), whole.end()) << "the case that matters";
    const int rows = static_cast<int>(lines("whole/log.csv").size()) - 1;
    for (const int stop : {1, rows - 1, rows}) {
      std::filesystem::remove_all(folder_.file("stopped"));
      RunOptions stopped = options("stopped");
      int row = 0;
      stopped.row = [&](const LogRow&, const std::vector<double>&, const Evaluation&, bool) {
        if (++row == stop) request_stop();
      };
      EXPECT_EQ(start_run(tiny(set), stopped), RunStatus::interrupted);
      clear_stop_request();
      resume_run(options("stopped"));
      EXPECT_EQ(found("stopped"), whole) << "stopped at row " << stop;
    }
  }
}

/// A run that was killed as its folder was cleared for another: that one begins anew, with its own target.
TEST_F(RunEnd, ANewRunTakesNothingThatWasLeft) {
  const std::vector<std::string> set = {"target.seed=99", "optimizer.iterations=3"};
  start_run(tiny(set), options("whole"));
  start_run(tiny({}), options("out"));
  std::filesystem::remove(folder_.file("out/experiment.yaml"));
  std::filesystem::create_directories(folder_.file("out/levels/1"));
  folder_.write("out/levels/1/experiment.yaml", "");
  start_run(tiny(set), options("out"));
  EXPECT_EQ(found("out"), found("whole"));
  EXPECT_TRUE(folder_.read("out/target.exr") == folder_.read("whole/target.exr"));
  EXPECT_FALSE(folder_.has("out/levels"));
}

}  // namespace
}  // namespace isochron
