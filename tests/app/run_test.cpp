// Runs, from their start over kills and resumes to their end.
#include "core/image/image.h"
#include "tests/app/program.h"

namespace isochron {
namespace {

TEST_F(Program, RunMovesTowardsTheTargetAndNeverOverwrites) {
  const Result lit = run(run_command("a"));
  ASSERT_EQ(lit.status, 0);
  EXPECT_EQ(lit.errors, "");
  for (const char* name : {"experiment.yaml", "log.csv", "checkpoint.yaml", "checkpoint.previous.yaml", "target.exr",
                           "initial.exr", "final.exr", "summary.yaml"})
    EXPECT_TRUE(folder_.has(std::string("a/") + name)) << name;
  EXPECT_EQ(rows("a"), 7);
  const std::string first = log("a");
  const Result again = run(run_command("a", {"--seed", "4"}));
  EXPECT_EQ(again.status, 0);
  EXPECT_NE(again.errors.find("a.1"), std::string::npos) << again.errors;
  EXPECT_EQ(log("a.1"), first);
  EXPECT_NE(log("a"), first);
  // What a reconstruction has left there is not this run's; what its experiment reads may be anybody's.
  for (const char* name : {"start.yaml", "surface.png", "back_projection.ply", "scene.yaml"})
    folder_.write(std::string("a/") + name, "start: {}\n");
  EXPECT_EQ(run(run_command("a", {"--force"})).status, 0);
  EXPECT_EQ(log("a"), first);
  for (const char* name : {"start.yaml", "surface.png", "back_projection.ply"})
    EXPECT_FALSE(folder_.has(std::string("a/") + name)) << name;
  EXPECT_TRUE(folder_.has("a/scene.yaml"));
  EXPECT_FALSE(folder_.has("a.2"));
}

TEST_F(Program, ResultsDoNotDependOnThreads) {
  for (const std::string method : {"adam", "lbfgs", "levenberg_marquardt"}) {
    const std::string set = "optimizer={method: " + method + ", iterations: 4}";
    ASSERT_EQ(run(run_command(method + "1", {"--threads", "1", "--set", set})).status, 0);
    ASSERT_EQ(run(run_command(method + "2", {"--threads", "2", "--set", set})).status, 0);
    expect_same_run(method + "1", method + "2");
  }
  ASSERT_EQ(run(run_command("seed", {"--seed", "4", "--set", "optimizer={iterations: 4}"})).status, 0);
  EXPECT_NE(log("adam1"), log("seed"));
}

TEST_F(Program, EveryMethodResumesToTheSameBits) {
  for (const std::string method : {"lbfgs", "levenberg_marquardt"}) {
    const std::vector<std::string> set = {"--set", "optimizer={method: " + method + ", iterations: 6}", "--set",
                                          "output.frames=3"};
    ASSERT_EQ(run(run_command(method, set)).status, 0);
    for (int signal : {SIGKILL, SIGINT}) {
      const std::string out = method + std::to_string(signal);
      run(run_command(out, set), signal, [&] { return rows(out) >= 3; });
      EXPECT_EQ(run({"resume", folder_.file(out), "--no-plots", "--quiet"}).status, 0);
      expect_same_run(method, out);
    }
  }
}

TEST_F(Program, KilledAnywhereAndResumedGivesTheSameBits) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  const std::vector<std::function<bool(const std::string&)>> moments = {
      [&](const std::string& out) { return folder_.has(out + "/experiment.yaml"); },
      [&](const std::string& out) { return folder_.has(out + "/target.exr"); },
      [&](const std::string& out) { return folder_.has(out + "/log.csv"); },
      [&](const std::string& out) { return rows(out) >= 1; },
      [&](const std::string& out) { return folder_.has(out + "/checkpoint.new.yaml"); },
      [&](const std::string& out) { return rows(out) >= 3; },
      [&](const std::string& out) { return rows(out) >= 5; },
      [&](const std::string& out) { return folder_.has(out + "/final.exr"); },
  };
  int killed = 0;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const std::string out = "killed" + std::to_string(i);
    if (run(run_command(out), SIGKILL, [&] { return moments[i](out); }).status == -SIGKILL) ++killed;
    // Killed once more while it goes on.
    run({"resume", folder_.file(out), "--no-plots", "--quiet"}, SIGKILL, [&] { return rows(out) >= 2; });
    const Result result = run({"resume", folder_.file(out), "--no-plots", "--quiet"});
    EXPECT_EQ(result.status, 0) << result.errors;
    expect_same_run("whole", out);
  }
  EXPECT_GE(killed, 5);  // the others may have ended before the signal came
}

TEST_F(Program, InterruptedLeavesACheckpointAndSaysHowToGoOn) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  for (int signal : {SIGINT, SIGTERM}) {
    const std::string out = "interrupted" + std::to_string(signal);
    const Result result = run(run_command(out), signal, [&] { return rows(out) >= 1; });
    EXPECT_EQ(result.status, 1);
    EXPECT_NE(result.errors.find("isochron resume " + folder_.file(out)), std::string::npos) << result.errors;
    EXPECT_NE(folder_.read(out + "/summary.yaml").find("status: interrupted"), std::string::npos);
    EXPECT_TRUE(folder_.has(out + "/checkpoint.yaml"));
    folder_.write(out + "/frames/000001.exr.4711-0.tmp", "as a process leaves it that is killed");
    EXPECT_EQ(run({"resume", folder_.file(out), "--no-plots", "--quiet"}).status, 0);
    expect_same_run("whole", out);
  }
}

TEST_F(Program, ResumingAFinishedRunSaysThatNothingWasLeft) {
  ASSERT_EQ(run(run_command("out")).status, 0);
  const std::string before = log("out");
  const auto resumed = [&] {
    const Result result = run({"resume", folder_.file("out"), "--no-plots"});
    EXPECT_EQ(result.status, 0) << result.errors;
    return folder_.read("stdout");
  };
  EXPECT_EQ(
      resumed().rfind("nothing was left to do: the run had ended before (to go on, raise optimizer.iterations in " +
                          folder_.file("out") + "/experiment.yaml)\niterations_reached after 6 iterations, ",
                      0),
      0u);
  EXPECT_EQ(log("out"), before);
  folder_.write("out/experiment.yaml", replaced(folder_.read("out/experiment.yaml"), "iterations: 6", "iterations: 8"));
  EXPECT_EQ(resumed().rfind("iterations_reached after 8 iterations, ", 0), 0u);
  EXPECT_EQ(rows("out"), 9);
}

TEST_F(Program, DamagedCheckpointFallsBack) {
  ASSERT_EQ(run(run_command("whole")).status, 0);
  ASSERT_EQ(run(run_command("damaged")).status, 0);
  folder_.write("damaged/checkpoint.yaml", folder_.read("damaged/checkpoint.yaml").substr(0, 100));
  const Result result = run({"resume", folder_.file("damaged"), "--no-plots", "--quiet"});
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.errors.find("damaged"), std::string::npos);
  expect_same_run("whole", "damaged");
}

TEST_F(Program, NonFiniteLossNeverReachesAParameter) {
  // The square of the images overflows.
  write_exr(folder_.file("black.exr"), GatedImage(8, 8, 2, 1));
  const Result result =
      run(run_command("out", {"--set", "target={images: black.exr}", "--set", "optimizer.iterations=20", "--set",
                              "parameters[1]={name: power, type: emission, shape: lamp, initial: 1e300}"}));
  EXPECT_EQ(result.status, 1);
  const std::string summary = folder_.read("out/summary.yaml");
  EXPECT_NE(summary.find("status: diverged\niterations: 4\n"), std::string::npos) << summary;
  EXPECT_NE(summary.find("rejected_steps: 5\n"), std::string::npos);
  EXPECT_NE(summary.find("  height: 0.2\n  power: 1e+300\n"), std::string::npos);
}

TEST_F(Program, AnOptimiserThatLeavesTheWorldIsSentBack) {
  for (const std::string method : {"adam", "lbfgs", "levenberg_marquardt"}) {
    SCOPED_TRACE(method);
    const Result result =
        run(run_command(method, {"--at", "height=0.3", "--set",
                                 "optimizer={method: " + method + ", learning_rate: 1e25, iterations: 3}"}));
    EXPECT_TRUE(result.status == 0 || result.status == 1) << result.status << result.errors;
    const std::string summary = folder_.read(method + "/summary.yaml");
    if (method == "adam") {
      EXPECT_NE(summary.find("rejected_steps: 2\n"), std::string::npos) << summary;
      EXPECT_NE(result.errors.find("loss or gradient is not finite"), std::string::npos) << result.errors;
    }
    EXPECT_NE(summary.find("  height: 0."), std::string::npos) << summary;
  }
}

TEST_F(Program, LightSubpathsInCapturesAreRefusedBeforeAnythingIsMade) {
  folder_.write("plane.obj", "v -0.2 -0.2 0\nv 0.2 -0.2 0\nv 0.2 0.2 0\nv -0.2 0.2 0\nf 1 2 3 4\n");
  folder_.write("wall.yaml",
                "capture:\n"
                "  sensor: {corner: [-0.3, 0.3, 0], across: [0.6, 0, 0], down: [0, -0.6, 0], size: [2, 2]}\n"
                "  normal: [0, 0, 1]\n  laser: confocal\n"
                "materials: {paint: {type: diffuse, albedo: 0.5, two_sided: true}}\n"
                "shapes: [{name: plane, file: plane.obj, material: paint, transform: {translate: [0, 0, 0.5]}}]\n");
  const std::string file =
      folder_.write("counts.yaml",
                    "name: counts\nscene: wall.yaml\nmax_bounces: 2\nestimator: {light: 0.5}\n"
                    "gates: {kind: bins, unit: ps, scene_unit_m: 1, start: 1600, width: 32, count: 120}\n"
                    "parameters:\n"
                    "  - {name: z, type: translation, shape: plane, direction: [0, 0, 1], initial: 0.2, target: 0}\n"
                    "target: {samples: 16}\nsamples: {primal: 4, interior: 4, visibility: 0, path_length: 0}\n");
  const Result result = run({"run", file, "-o", folder_.file("out")});
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.errors.find(
                "counts.yaml:4:20: estimator.light: paths of captures have no light subpaths (allowed here: 0)"),
            std::string::npos)
      << result.errors;
  EXPECT_FALSE(folder_.has("out"));
}

// A plate before a wall, 20 cm too far away: no bin that it could reach has light at first.
TEST_F(Program, ARunThatLosesTheLightOfItsCountsDiverges) {
  folder_.write("plane.obj", "v -0.2 -0.2 0\nv 0.2 -0.2 0\nv 0.2 0.2 0\nv -0.2 0.2 0\nf 1 2 3 4\n");
  folder_.write("wall.yaml",
                "capture:\n"
                "  sensor: {corner: [-0.3, 0.3, 0], across: [0.6, 0, 0], down: [0, -0.6, 0], size: [6, 6]}\n"
                "  normal: [0, 0, 1]\n  laser: confocal\n"
                "materials: {paint: {type: diffuse, albedo: 0.5, two_sided: true}}\n"
                "shapes: [{name: plane, file: plane.obj, material: paint, transform: {translate: [0, 0, 0.5]}}]\n");
  const std::string file =
      folder_.write("counts.yaml",
                    "name: counts\nscene: wall.yaml\nmax_bounces: 1\n"
                    "gates: {kind: bins, unit: ps, scene_unit_m: 1, start: 1600, width: 32, count: 120}\n"
                    "parameters:\n"
                    "  - {name: z, type: translation, shape: plane, direction: [0, 0, 1], initial: 0.2, target: 0}\n"
                    "  - {name: gain, type: gain, initial: 50, target: 60}\n"
                    "  - {name: dark, type: background, initial: 1, target: 0.5}\n"
                    "target: {samples: 256, noise: {counts: true}}\nloss: {kind: poisson}\n"
                    "samples: {primal: 64, interior: 64, visibility: 0, path_length: 0}\n"
                    "optimizer: {method: quasi_newton, iterations: 4}\noutput: {histogram_samples: 256}\n");
  const auto go = [&](const char* out, const char* z) {
    return run({"run", file, "-o", folder_.file(out), "--no-plots", "--at", z}).status;
  };
  EXPECT_EQ(go("far", "z=0.2"), 1);
  const std::string lost = folder_.read("far/summary.yaml");
  EXPECT_TRUE(lost.starts_with("status: diverged\n")) << lost;
  EXPECT_NE(lost.find("verdict: unexplained}"), std::string::npos) << lost;
  EXPECT_NE(folder_.read("stdout").find("start nearer"), std::string::npos);
  for (const char* name : {"far/checkpoint.yaml", "far/final.exr", "far/final.h5", "far/log.csv"})
    EXPECT_TRUE(folder_.has(name)) << name;
  EXPECT_EQ(go("near", "z=0.01"), 0);
  EXPECT_EQ(folder_.read("near/summary.yaml").find("status: diverged"), std::string::npos);
}

TEST_F(Program, CoordinatesThatCannotBeRenderedAreRefused) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  for (const std::vector<std::string>& change : std::vector<std::vector<std::string>>{
           {"--at", "height=1e25"}, {"--set", "parameters[0].initial=1e25"}, {"--set", "parameters[0].target=-1e25"}}) {
    std::vector<std::string> command = {"derive", file, "-o", out, "--no-plots"};
    command.insert(command.end(), change.begin(), change.end());
    const Result result = run(command);
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.errors.find("too far away"), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1);
  }
}

TEST_F(Program, ARunDoesNotLeaveOutTheJumpsOfItsGates) {
  const std::vector<std::string> boxcars = {"--set", "gates={kind: boxcar, width: 0.1, centers: [4.0]}",
                                            "--set", "samples={primal: 8, interior: 8, visibility: 8, path_length: 0}",
                                            "--set", "optimizer.iterations=1"};
  const Result result = run(run_command("out", boxcars));
  EXPECT_EQ(result.status, 0) << result.errors;
  EXPECT_NE(result.errors.find("samples.path_length: taken as 8, as of interior"), std::string::npos) << result.errors;
  EXPECT_NE(folder_.read("out/experiment.yaml").find("path_length: 8"), std::string::npos);
}

TEST_F(Program, AnExplodedLossIsADivergence) {
  // From an emission far below the target one step of 500 leads far above it.
  const Result result =
      run(run_command("out", {"--at", "height=0,power=2", "--set", "optimizer.learning_rate=500", "--set",
                              "parameters[0].upper=0.01", "--set", "parameters[0].lower=0", "--set",
                              "parameters[0].initial=0", "--set", "optimizer.iterations=1"}));
  EXPECT_EQ(result.status, 1) << result.errors;
  EXPECT_NE(folder_.read("out/summary.yaml").find("status: diverged"), std::string::npos);
}

TEST_F(Program, StopsWhenTheImagesAgree) {
  const Result result = run(run_command("out", {"--at", "target", "--set", "optimizer.tolerance=0.5"}));
  EXPECT_EQ(result.status, 0) << result.errors;
  EXPECT_NE(folder_.read("out/summary.yaml").find("status: converged\niterations: 0\n"), std::string::npos);
}

/// Files of the current folder that are called as Python's modules are none of those.
TEST_F(Program, DrawsItsPlotsBesideFilesOfAnyName) {
  for (const char* name : {"string.py", "html.py", "isochron.py"}) folder_.write(name, "raise SystemExit(3)\n");
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  const Result result =
      run({"run", folder_.file("tiny.yaml"), "-o", folder_.file("out"), "--set", "optimizer.iterations=1"});
  std::filesystem::current_path(before);
  EXPECT_EQ(result.status, 0) << result.errors;
  EXPECT_TRUE(folder_.has("out/rmse.png"));
  EXPECT_TRUE(folder_.has("out/report.html"));
}

TEST_F(Program, DrawsItsPlots) {
  const Result result =
      run({"run", folder_.file("tiny.yaml"), "-o", folder_.file("out"), "--set", "optimizer.iterations=1"});
  EXPECT_EQ(result.status, 0) << result.errors;
  for (const char* name : {"target.png", "initial.png", "final.png", "rmse.png"})
    EXPECT_TRUE(folder_.has(std::string("out/") + name)) << name;
}

}  // namespace
}  // namespace isochron
