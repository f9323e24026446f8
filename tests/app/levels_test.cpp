// Runs in levels, from their start over kills and resumes to their end.
#include "tests/app/program.h"

namespace isochron {
namespace {

class LevelsProgram : public Program {
 protected:
  LevelsProgram() {
    folder_.write("tiny.yaml",
                  replaced(replaced(tiny_experiment(), "type: translation", "type: vertices, remesh: {levels: 3}"),
                           "iterations: 6", "iterations: 4"));
  }

  Result resume(const std::string& out, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{"resume", folder_.file(out), "--no-plots", "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }

  /// All that does not tell the time.
  void expect_same_levels(const std::string& a, const std::string& b) const {
    for (const char* level : {"/levels/1", "/levels/2", "/levels/3"}) {
      SCOPED_TRACE(level);
      expect_same_run(a + level, b + level);
      EXPECT_EQ(folder_.read(a + level + "/experiment.yaml"), folder_.read(b + level + "/experiment.yaml"));
    }
    for (const char* file :
         {"/target.exr", "/geometry/target_block.ply", "/initial.exr", "/final.exr", "/geometry/initial_block.ply",
          "/geometry/final_block.ply", "/levels/3/scene/surface.ply", "/levels/3/scene/scene.yaml"}) {
      EXPECT_TRUE(folder_.has(a + file)) << file;
      EXPECT_TRUE(folder_.read(a + file) == folder_.read(b + file)) << file;
    }
    EXPECT_EQ(rows(b), 15);
    EXPECT_EQ(log(a), log(b));
    EXPECT_TRUE(folder_.read(b + "/summary.yaml").starts_with("status: iterations_reached"));
  }
};

TEST_F(LevelsProgram, ResultsDoNotDependOnThreadsOrTheFoldersPlace) {
  ASSERT_EQ(run(run_command("one", {"--threads", "1"})).status, 0);
  ASSERT_EQ(run(run_command("two", {"--threads", "2"})).status, 0);
  expect_same_levels("one", "two");
  std::filesystem::rename(folder_.file("two"), folder_.file("moved"));
  EXPECT_EQ(resume("moved").status, 0);
  expect_same_levels("one", "moved");
}

TEST_F(LevelsProgram, KilledAnywhereAndResumedGivesTheSameBits) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  const std::vector<std::function<bool(const std::string&)>> moments = {
      [&](const std::string& out) { return folder_.has(out + "/experiment.yaml"); },
      [&](const std::string& out) { return folder_.has(out + "/target.exr"); },
      [&](const std::string& out) { return rows(out + "/levels/1") >= 2; },
      [&](const std::string& out) { return folder_.has(out + "/levels/1/summary.yaml"); },
      [&](const std::string& out) { return folder_.has(out + "/levels/2/scene/surface.ply"); },
      [&](const std::string& out) { return folder_.has(out + "/levels/2/experiment.yaml"); },
      [&](const std::string& out) { return rows(out + "/levels/2") >= 3; },
      [&](const std::string& out) { return rows(out + "/levels/3") >= 3; },
      [&](const std::string& out) { return folder_.has(out + "/levels/3/final.exr"); },
  };
  int killed = 0;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const std::string out = "killed" + std::to_string(i);
    if (run(run_command(out), SIGKILL, [&] { return moments[i](out); }).status == -SIGKILL) ++killed;
    const Result result = resume(out);
    EXPECT_EQ(result.status, 0) << result.errors;
    expect_same_levels("whole", out);
  }
  EXPECT_GE(killed, 6);  // the others may have ended before the signal came
}

TEST_F(LevelsProgram, InterruptedLeavesTheBestSoFar) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  const Result result = run(run_command("stopped"), SIGINT, [&] { return rows("stopped/levels/2") >= 2; });
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.errors.find("isochron resume " + folder_.file("stopped")), std::string::npos) << result.errors;
  const std::string summary = folder_.read("stopped/summary.yaml");
  EXPECT_TRUE(summary.starts_with("status: interrupted")) << summary;
  EXPECT_NE(summary.find("levels:\n  - {edge_length: "), std::string::npos);
  EXPECT_TRUE(folder_.read("stopped/final.exr") == folder_.read("whole/levels/1/final.exr"));
  EXPECT_TRUE(folder_.has("stopped/levels/2/checkpoint.yaml"));
  EXPECT_EQ(resume("stopped").status, 0);
  expect_same_levels("whole", "stopped");
}

TEST_F(LevelsProgram, MoreLevelsMayFollow) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  folder_.write("tiny.yaml", replaced(folder_.read("tiny.yaml"), "levels: 3", "levels: 2"));
  ASSERT_EQ(run(run_command("fewer")).status, 0);
  EXPECT_FALSE(folder_.has("fewer/levels/3"));
  folder_.write("fewer/experiment.yaml", replaced(folder_.read("fewer/experiment.yaml"), "levels: 2", "levels: 3"));
  EXPECT_EQ(resume("fewer").status, 0);
  expect_same_levels("whole", "fewer");
  EXPECT_EQ(run(run_command("whole", {"--force"})).status, 0);  // with two levels, the third is gone
  EXPECT_FALSE(folder_.has("whole/levels/3"));
}

TEST_F(LevelsProgram, PageAndPlotsShowTheLastLevel) {
  ASSERT_EQ(run(run_command("out")).status, 0);
  EXPECT_EQ(run({"report", folder_.file("out")}).status, 0);
  EXPECT_EQ(run({"plot", folder_.file("out")}).status, 0);
  const std::string page = folder_.read("out/report.html");
  EXPECT_NE(page.find("Levels; the page shows the last one"), std::string::npos);
  EXPECT_EQ(page.find("left out"), std::string::npos);
  EXPECT_TRUE(folder_.has("out/final.png"));
  EXPECT_TRUE(folder_.has("out/rmse.png"));
  EXPECT_TRUE(folder_.has("out/levels/3/report/derivatives/derivatives.yaml"));
}

}  // namespace
}  // namespace isochron
