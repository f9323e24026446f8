// The folder of a run: its lock, its copies of the inputs.
#include "core/scene/mesh.h"
#include "tests/app/program.h"

namespace isochron {
namespace {

int lines(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

TEST_F(Program, TwoRunsInOneFolderAreRefused) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  const std::string out = folder_.file("live");
  const auto refused = [&](const std::vector<std::string>& command) {
    const Result result = run(command);
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.errors.find(out + ": another isochron is running in this folder"), std::string::npos)
        << result.errors;
    EXPECT_EQ(lines(result.errors), 1);
  };
  const std::vector<std::string> slow = run_command("live", {"--set", "optimizer.iterations=1000000"});
  const Result live = run(slow, SIGKILL, [&] {
    if (rows("live") < 2) return false;
    refused(run_command("live"));
    refused(run_command("live", {"--force"}));
    refused({"resume", out});
    return true;
  });
  EXPECT_EQ(live.status, -SIGKILL);
  EXPECT_FALSE(folder_.has("live.1"));
  // The lock went with the process.
  EXPECT_EQ(run(run_command("live", {"--force"})).status, 0);
  expect_same_run("whole", "live");
}

TEST_F(Program, ARunCanBeMovedAwayFromItsInputs) {
  folder_.write("heights.txt", "0.2\n");
  folder_.write("gate.txt", "-0.3 0\n0 1\n0.3 0\n");
  std::string text = replaced(tiny_experiment(), "initial: 0.2", "initial: heights.txt");
  text = replaced(text, "{kind: gaussian, centers: [4.5, 5.5], sigma: 0.3}",
                  "{kind: tabulated, centers: [4.5, 5.5], file: gate.txt}");
  folder_.write("tiny.yaml", text);
  ASSERT_EQ(run(run_command("whole")).status, 0);
  std::filesystem::copy(folder_.file("whole/target.exr"), folder_.file("measured.exr"));
  const std::vector<std::string> set = {"--set", "target={images: measured.exr}"};
  ASSERT_EQ(run(run_command("fitted", set)).status, 0);
  run(run_command("a"), SIGKILL, [&] { return rows("a") >= 2; });
  run(run_command("b", set), SIGKILL, [&] { return rows("b") >= 2; });
  for (const char* file : {"inputs/experiment.yaml", "inputs/heights.txt", "inputs/gate.txt", "inputs/scene/scene.yaml",
                           "inputs/scene/floor.obj", "inputs/scene/block.obj", "inputs/scene/lamp.obj"})
    EXPECT_TRUE(folder_.has(std::string("a/") + file)) << file;
  EXPECT_EQ(folder_.read("a/inputs/experiment.yaml"), text);
  EXPECT_NE(folder_.read("a/experiment.yaml").find("scene: \"inputs/scene/scene.yaml\"\n"), std::string::npos);
  EXPECT_NE(folder_.read("b/experiment.yaml").find("images: \"inputs/measured.exr\"\n"), std::string::npos);

  for (const char* file :
       {"tiny.yaml", "scene.yaml", "floor.obj", "block.obj", "lamp.obj", "heights.txt", "gate.txt", "measured.exr"})
    std::filesystem::remove(folder_.file(file));
  std::filesystem::create_directory(folder_.file("far"));
  for (const std::string name : {"a", "b"}) {
    std::filesystem::rename(folder_.file(name), folder_.file("far/" + name));
    const Result result = run({"resume", folder_.file("far/" + name), "--no-plots", "--quiet"});
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.errors, "");
    expect_same_run(name == "a" ? "whole" : "fitted", "far/" + name);
  }
  // What a run's folder holds is an experiment like any other, with itself as the output folder too.
  const std::string again = folder_.file("far/a/experiment.yaml");
  ASSERT_EQ(run({"run", again, "-o", folder_.file("far/a"), "--force", "--no-plots", "--quiet"}).status, 0);
  expect_same_run("whole", "far/a");
}

TEST_F(Program, ChangedInputsAreNoticed) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  run(run_command("a"), SIGKILL, [&] { return rows("a") >= 2; });
  const std::string mesh = folder_.read("block.obj");
  folder_.write("block.obj", replaced(mesh, "v -0.5 0.5 -0.5", "v -0.7 0.5 -0.7"));
  const std::vector<std::string> resume = {"resume", folder_.file("a"), "--no-plots", "--quiet"};
  const Result result = run(resume);
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.errors.find("changed since the run began: " + folder_.file("block.obj") + "; continuing with the "),
            std::string::npos)
      << result.errors;
  EXPECT_EQ(lines(result.errors), 1);
  expect_same_run("whole", "a");

  folder_.write("a/inputs/scene/block.obj", folder_.read("block.obj"));
  const Result refused = run(resume);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.errors.find("a/inputs/scene/block.obj: has changed since the run began"), std::string::npos)
      << refused.errors;
  std::filesystem::remove(folder_.file("a/inputs/scene/block.obj"));
  EXPECT_NE(run(resume).errors.find("a/inputs/scene/block.obj: has gone since the run began"), std::string::npos);
}

TEST_F(Program, RunsWriteTheGeometryThatMoves) {
  folder_.write("scene.yaml", replaced(folder_.read("scene.yaml"), "name: block,", "name: a/block,"));
  folder_.write("tiny.yaml", replaced(tiny_experiment(), "shape: block", "shape: a/block"));
  const std::vector<std::string> set = {"--set", "output={every: 2}"};
  ASSERT_EQ(run(run_command("whole", set)).status, 0);
  run(run_command("killed", set), SIGKILL, [&] { return rows("killed") >= 4; });
  ASSERT_EQ(run({"resume", folder_.file("killed"), "--no-plots", "--quiet"}).status, 0);
  for (const char* name : {"initial", "target", "final", "000002", "000004", "000006"}) {
    const std::string file = std::string("/geometry/") + name + "_a_block.ply";
    EXPECT_TRUE(folder_.has("whole" + file)) << file;
    EXPECT_EQ(folder_.read("whole" + file), folder_.read("killed" + file)) << file;
  }
  const auto files = std::filesystem::directory_iterator(folder_.file("whole/geometry"));
  EXPECT_EQ(std::distance(files, {}), 6);  // neither the floor nor the lamp
  EXPECT_NEAR(read_mesh(folder_.file("whole/geometry/initial_a_block.ply")).positions[0].y, 0.7, 1e-6);
  EXPECT_NEAR(read_mesh(folder_.file("whole/geometry/target_a_block.ply")).positions[0].y, 0.5, 1e-6);
  const std::string log = folder_.read("whole/log.csv");
  const std::size_t last = log.rfind('\n', log.size() - 2);
  std::istringstream row(log.substr(last));
  std::string cell;
  for (int i = 0; i < 7; ++i) std::getline(row, cell, ',');
  EXPECT_NEAR(read_mesh(folder_.file("whole/geometry/final_a_block.ply")).positions[0].y, 0.5 + std::stod(cell), 1e-6);

  ASSERT_EQ(run(run_command("obj", {"--set", "output={geometry: obj}"})).status, 0);
  EXPECT_TRUE(folder_.has("obj/geometry/final_a_block.obj"));
  EXPECT_FALSE(folder_.has("obj/geometry/000002_a_block.obj"));
  ASSERT_EQ(run(run_command("none", {"--set", "output={geometry: none, every: 1}"})).status, 0);
  EXPECT_FALSE(folder_.has("none/geometry"));
  ASSERT_EQ(run(run_command("whole", {"--set", "output={geometry: none}", "--force"})).status, 0);
  EXPECT_FALSE(folder_.has("whole/geometry"));
}

TEST_F(Program, AFolderOfTheUsersIsNotWrittenTo) {
  std::filesystem::create_directories(folder_.file("mine/inputs"));
  folder_.write("mine/inputs/experiment.yaml", "mine");
  const Result result = run(run_command("mine"));
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.errors.find("mine/inputs: is there already and not of a run"), std::string::npos) << result.errors;
  EXPECT_EQ(folder_.read("mine/inputs/experiment.yaml"), "mine");
}

}  // namespace
}  // namespace isochron
