// The commands: what they write.
#include "tests/app/program.h"

#include <sstream>

#include "core/image/image.h"

namespace isochron {
namespace {

TEST_F(Program, MistypedCommandsAndOptionsAreCorrected) {
  const Result result = run({"rendr", folder_.file("tiny.yaml")});
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.errors, "isochron: error: 'rendr' is not a command, did you mean 'render'? (see isochron --help)\n");
  EXPECT_EQ(run({"render", folder_.file("tiny.yaml"), "--sample=3"}).errors,
            "isochron: error: '--sample' is not an option of render, did you mean '--samples'? (see isochron render "
            "--help)\n");
}

TEST_F(Program, PlotNeedsAFolder) {
  const Result result = run({"plot", folder_.file("nowhere")});
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.errors, "isochron: error: plot: " + folder_.file("nowhere") + ": no such folder\n");
  const Result nothing = run({"plot", folder_.path()});
  EXPECT_EQ(nothing.status, 2);
  EXPECT_NE(nothing.errors.find(": nothing to draw (allowed: "), std::string::npos) << nothing.errors;
}

TEST_F(Program, EveryCommandHasAFolderOfItsOwn) {
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  for (const std::string command : {"render", "derive", "gradient", "check"}) {
    EXPECT_EQ(run({command, "tiny.yaml", "--no-plots", "--quiet", "--samples", "16"}).status, 0);
    EXPECT_TRUE(folder_.has("runs/tiny-" + command + "/" + command + ".csv"));
    run({command, "--help"});
    EXPECT_NE(folder_.read("stdout").find("runs/NAME-" + command), std::string::npos);
  }
  EXPECT_FALSE(folder_.has("runs/tiny"));
  std::filesystem::current_path(before);
}

TEST_F(Program, HelpShowsExamples) {
  for (const char* command :
       {"run", "resume", "render", "derive", "gradient", "check", "inspect", "chart", "stability"}) {
    EXPECT_EQ(run({command, "--help"}).status, 0);
    EXPECT_NE(folder_.read("stdout").find(std::string("  isochron ") + command), std::string::npos);
  }
  EXPECT_EQ(run({"--version"}).status, 0);
}

TEST_F(Program, CommandsWriteTheirFiles) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  ASSERT_EQ(run({"render", file, "-o", out, "--no-plots"}).status, 0);
  EXPECT_EQ(
      folder_.read("out/render.csv")
          .rfind("gate,mean,standard_error,replicates,degrees_of_freedom,effective_count,half_width_95,gate_center\n0,",
                 0),
      0u);
  const GatedImage image = read_exr(out + "/render.exr");
  EXPECT_EQ(image.gates, 2);
  EXPECT_EQ(image.channels, 1);

  ASSERT_EQ(run({"derive", file, "-o", out, "--no-plots", "--parameter", "height"}).status, 0);
  EXPECT_TRUE(folder_.has("out/height.exr"));
  EXPECT_FALSE(folder_.has("out/power.exr"));
  const std::string derive = folder_.read("out/derive.csv");
  EXPECT_EQ(derive.rfind("parameter,gate,component,mean,standard_error,replicates,degrees_of_freedom,effective_count,"
                         "half_width_95,gate_center\nheight,0,total,",
                         0),
            0u);
  for (const char* row : {"height,1,total,", "height,1,interior,", "height,1,visibility,"})
    EXPECT_NE(derive.find(row), std::string::npos);

  ASSERT_EQ(run({"gradient", file, "-o", out, "--at", "target"}).status, 0);
  EXPECT_NE(folder_.read("stdout").find("  height: "), std::string::npos);
  const std::string gradient = folder_.read("out/gradient.csv");
  EXPECT_EQ(
      gradient.rfind(
          "parameter,value,gradient,standard_error,degrees_of_freedom,effective_count,half_width_95\nheight,0,", 0),
      0u);
  EXPECT_NE(gradient.find("\npower,10,"), std::string::npos);
  const std::string cost = folder_.read("out/gradient.yaml");
  for (const char* key : {"seconds: ", "threads: ", "repeats: 8\n"}) EXPECT_NE(cost.find(key), std::string::npos);
}

TEST_F(Program, EveryFileWrittenIsNamed) {
  const std::string file = folder_.file("tiny.yaml");
  const std::vector<std::vector<std::string>> commands = {
      {"render"},
      {"render", "--no-plots"},
      {"derive"},
      {"derive", "--parameter", "height", "--no-plots"},
      {"gradient", "--no-plots"},
      {"check", "--samples", "16"},
      {"inspect", "--seconds", "0.5"},
      {"chart", "--seconds", "1"},
      {"run", "--set", "optimizer.iterations=1"},
  };
  for (std::vector<std::string> command : commands) {
    const std::string name = command[0] + std::to_string(command.size()), out = folder_.file(name);
    command.insert(command.begin() + 1, {file, "-o", out});
    const Result result = run(command);
    // A check disagrees by chance, too.
    EXPECT_TRUE(result.status == 0 || (result.status == 1 && folder_.has(name + "/check.csv"))) << result.errors;
    const std::string shown = result.errors + folder_.read("stdout");
    for (const auto& entry : std::filesystem::directory_iterator(out)) {
      const std::string written = entry.path().filename().string();
      EXPECT_TRUE(written == ".lock" || shown.find(written) != std::string::npos) << written << " of " << shown;
    }
  }
}

TEST_F(Program, CheckAgreesWithFiniteDifferences) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  // False alarm: 1 %, seed fixed.
  const Result result = run({"check", file, "-o", out, "--samples", "256"});
  EXPECT_EQ(result.status, 0) << result.errors << folder_.read("stdout");
  const std::string table = folder_.read("out/check.csv");
  EXPECT_EQ(table.rfind("parameter,gate,interior,visibility,path_length,total,standard_error,"
                        "finite_difference,finite_difference_error,z,limit,degrees_of_freedom,effective_count,"
                        "gate_center\nheight,0,",
                        0),
            0u);
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5);
  EXPECT_EQ(std::count(table.begin(), table.end(), ','), 5 * 13);
  EXPECT_NE(folder_.read("stdout").find("0 of 4 differ"), std::string::npos);
  ASSERT_EQ(run({"check", file, "-o", out, "--samples", "256", "--parameter", "power"}).status, 0);
  EXPECT_EQ(folder_.read("out/check.csv").find("height"), std::string::npos);
}

TEST_F(Program, InspectAppliesItsAdvice) {
  // What is asked for is found to be too much; comments stay.
  const std::string before = replaced(tiny_experiment(), "max_bounces: 2\n", "max_bounces: 9   # far too many\n");
  const std::string file = folder_.write("tiny.yaml", before), out = folder_.file("out");
  const Result result = run({"inspect", file, "-o", out, "--seconds", "1", "--apply"});
  ASSERT_EQ(result.status, 0) << result.errors;
  const std::string fragment = folder_.read("out/inspect.yaml"), table = folder_.read("out/inspect.csv");
  EXPECT_EQ(fragment.rfind("max_bounces: ", 0), 0u) << fragment;
  EXPECT_NE(folder_.read("stdout").find(fragment), std::string::npos);
  EXPECT_EQ(
      table.rfind(
          "point,quantity,term,bounces,gate,shape,technique,share,standard_error,gate_center\nstart,light,,0,0,,,", 0),
      0u);
  // What techniques bring adds up to all light, and to all of their work.
  double light = 0, work = 0;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    const auto share = [&](const std::string& start) {
      const bool matches = line.rfind(start, 0) == 0 && line[start.size()] != ',';
      return matches ? std::stod(line.substr(line.find(',', start.size()) + 1)) : 0;
    };
    light += share("start,light,,,,,");
    work += share("start,work,,,,,");
  }
  EXPECT_NEAR(light, 1, 1e-9);
  EXPECT_NEAR(work, 1, 1e-9);
  const std::string after = folder_.read("tiny.yaml");
  EXPECT_NE(after.find("   # far too many\n"), std::string::npos) << after;
  const int bounces = after[after.find("max_bounces: ") + 13] - '0';
  EXPECT_LT(bounces, 9);  // the block and the floor reflect light to and fro, but not nine times
  EXPECT_GE(bounces, 1);
  EXPECT_NE(after.find("max_bounces: 9}"), std::string::npos) << after;  // the target's light is as it was
  EXPECT_EQ(run({"render", file, "-o", out, "--no-plots"}).status, 0);
}

TEST_F(Program, ChartComparesTheMethods) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  const Result result = run({"chart", file, "-o", out, "--seconds", "0.4", "--steps", "0.05", "--quiet"});
  EXPECT_EQ(result.status, 0) << result.errors;
  EXPECT_TRUE(folder_.has("out/chart.png"));
  const std::string chart = folder_.read("out/chart.csv"), table = folder_.read("out/chart_table.csv");
  EXPECT_EQ(chart.rfind("method,factor,repeats,core_seconds,error,variance,variance_error,bias2,bias2_error,"
                        "components,unknowns\nreference,,32,",
                        0),
            0u);
  for (const char* method :
       {"standard", "ellipsoidal_uncoupled", "ellipsoidal_coupled", "auto", "finite_difference_0.05", "paper"}) {
    EXPECT_NE(chart.find(std::string("\n") + method + ","), std::string::npos) << method;
    EXPECT_NE(table.find(std::string("\n") + method + ","), std::string::npos) << method;
  }
  EXPECT_NE(folder_.read("stdout").find("max_bounces is 2: no method with 3 bounces"), std::string::npos);
  const Result techniques = run({"chart", file, "-o", out, "--seconds", "0.4", "--techniques", "--quiet"});
  EXPECT_EQ(techniques.status, 0) << techniques.errors;
  const std::string without = folder_.read("out/chart_table.csv");
  for (const char* method : {"auto", "without_standard", "without_ellipsoidal", "without_light", "without_wedge",
                             "without_aimed", "without_from_camera", "without_at_length", "without_light_arcs"})
    EXPECT_NE(without.find(std::string("\n") + method + ","), std::string::npos) << method;
  EXPECT_EQ(without.find("paper"), std::string::npos);
  // A parameter without any influence has no gradient to compare.
  const Result dark = run({"chart", file, "-o", out, "--seconds", "0.1", "--set", "gates.centers=[90]"});
  EXPECT_EQ(dark.status, 1);
  EXPECT_NE(dark.errors.find("does not stand out of its noise"), std::string::npos) << dark.errors;
}

TEST_F(Program, ChartOfTheOptimisers) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  const Result result = run({"chart", file, "-o", out, "--solvers", "--seeds", "2", "--seconds", "0.3", "--quiet"});
  EXPECT_EQ(result.status, 0) << result.errors;
  EXPECT_TRUE(folder_.has("out/chart_solvers.png"));
  const std::string csv = folder_.read("out/chart_solvers.csv");
  EXPECT_EQ(csv.rfind("method,seed,iteration,core_seconds,error\nadam,3,0,0,1\nadam,3,1,", 0), 0u) << csv;
  for (const char* row : {"\nadam,4,0,0,1\n", "\nlbfgs,4,1,", "\nlevenberg_marquardt,4,1,"})
    EXPECT_NE(csv.find(row), std::string::npos) << row;
}

TEST_F(Program, StabilityMapsWidthsAndMethods) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  const Result result = run({"stability", file, "-o", out, "--seconds", "0.5", "--widths", "1e-3,0.05", "--iterations",
                             "3", "--steps", "0.05", "--quiet"});
  EXPECT_EQ(result.status, 0) << result.errors;
  EXPECT_TRUE(folder_.has("out/stability.png"));
  const std::string csv = folder_.read("out/stability.csv");
  EXPECT_EQ(csv.rfind("width,method,factor,core_seconds,positive,cosine,cosine_error,zero,variance,bias2,bias2_error,"
                      "error_ratio,reference_error,failure\n0.05,standard,",
                      0),
            0u)
      << csv;
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 2 * 6);
  EXPECT_NE(csv.find("\n0.001,finite_difference_0.05,"), std::string::npos);
  EXPECT_NE(csv.find("\n0.001,finite_difference_0.05_independent,"), std::string::npos);
  const Result steady = run({"stability", file, "-o", out, "--set", "gates={kind: steady}"});
  EXPECT_NE(steady.errors.find("steady gates have no width"), std::string::npos) << steady.errors;
}

TEST_F(Program, ShapesOnTheSameSurfaceAreNamedOnce) {
  const std::string file = folder_.file("tiny.yaml"), scene = folder_.read("scene.yaml");
  const std::string ghost = "  - {name: ghost, file: block.obj, material: white}\n";
  folder_.write("scene.yaml", scene + ghost);
  const std::string warning = "'ghost' on 'block' (2 triangles)";
  const auto warnings = [&](const Result& result) {
    EXPECT_EQ(result.status, 0);
    int count = 0;
    for (std::size_t at = result.errors.find(warning); at != std::string::npos;
         at = result.errors.find(warning, at + 1))
      ++count;
    return count;
  };
  // The block starts 0.2 above and is to come down on it.
  EXPECT_EQ(warnings(run({"render", file, "-o", folder_.file("look"), "--no-plots", "--quiet"})), 1);
  EXPECT_EQ(warnings(run(run_command("run"))), 1);
  EXPECT_EQ(warnings(run(run_command("away", {"--set", "parameters[0].target=0.1"}))), 0);
}

}  // namespace
}  // namespace isochron
