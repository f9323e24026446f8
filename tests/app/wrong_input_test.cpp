// What the commands say of wrong input.
#include <sys/stat.h>
#include <unistd.h>

#include <sstream>

#include "tests/app/program.h"

namespace isochron {
namespace {

TEST_F(Program, WrongInputEndsWithStatusTwoAndOneLine) {
  const std::string file = folder_.file("tiny.yaml");
  const std::string out = folder_.file("out");
  folder_.write("plain", "");
  const std::vector<std::vector<std::string>> commands = {
      {},
      {"polish"},
      {"run"},
      {"run", file, "--unknown"},
      {"run", folder_.file("gone.yaml")},
      {"run", file, "-o", folder_.file("plain") + "/out"},
      {"run", file, "-o", out, "--set", "gates.sigma=-1"},
      {"run", file, "-o", out, "--set", "parameters[0].shape=teapot"},
      {"run", file, "-o", out, "--set", "parameters=[]"},
      {"run", file, "-o", out, "--threads", "-1"},
      {"render", file, "-o", out, "--samples", "1"},
      {"render", file, "-o", out, "--at", "width=1"},
      {"derive", file, "-o", out, "--parameter", "width"},
      {"derive", file, "-o", out, "--set", "samples.visibility=1"},
      {"gradient", file, "-o", out, "--samples", "1"},
      {"inspect", file, "-o", out, "--seconds", "0"},
      {"inspect", file, "-o", out, "--apply", "--samples", "4"},
      {"chart", file, "-o", out, "--seconds", "0"},
      {"chart", file, "-o", out, "--steps", "0.1,-1"},
      {"chart", file, "-o", out, "--set", "parameters=[]"},
      {"chart", file, "-o", out, "--solvers", "--at", "target", "--set", "parameters[0].initial=0", "--set",
       "parameters[1].initial=10"},
      {"stability", file, "-o", out, "--widths", "0.1,-1"},
      {"stability", file, "-o", out, "--widths", "1e-300"},
      {"chart", file, "-o", out, "--seeds", "2"},
      {"chart", file, "-o", out, "--solvers", "--steps", "0.1"},
      {"stability", file, "-o", out, "--set", "gates={kind: steady}"},
      {"resume", out},
  };
  for (const auto& command : commands) {
    const Result result = run(command);
    EXPECT_EQ(result.status, 2) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
  EXPECT_FALSE(folder_.has("out/experiment.yaml"));
}

TEST_F(Program, TargetValuesAreForThoseWhoRenderTheTarget) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out"), unset = "parameters[0].target=";
  const std::vector<std::string> common = {"-o", out, "--no-plots", "--quiet", "--set", unset};
  const auto status = [&](std::vector<std::string> command) {
    command.insert(command.end(), common.begin(), common.end());
    const Result result = run(command);
    EXPECT_EQ(result.errors.find("target") != std::string::npos, result.status == 2) << result.errors;
    return result.status;
  };
  EXPECT_EQ(status({"render", file}), 0);
  EXPECT_EQ(status({"derive", file}), 0);
  EXPECT_EQ(status({"render", file, "--at", "target"}), 2);
  EXPECT_EQ(status({"gradient", file}), 2);
  EXPECT_EQ(status({"run", file}), 2);
}

TEST_F(Program, AFileThatCannotBeReplacedIsAMistakeInTheInput) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  std::filesystem::create_directories(out + "/render.exr");
  const Result result = run({"render", file, "-o", out, "--no-plots", "--quiet"});
  EXPECT_EQ(result.status, 2);
  EXPECT_EQ(result.errors, "isochron: error: " + out + "/render.exr: cannot be written: Is a directory\n");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(out), {}), 1);  // nothing beside it
}

TEST_F(Program, APipeIsNoExperiment) {
  const std::string pipe = folder_.file("pipe.yaml");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  bool waits = false;
  const auto start = std::chrono::steady_clock::now();
  const Result result = run({"render", pipe}, SIGKILL, [&] {
    return waits = std::chrono::steady_clock::now() - start > std::chrono::seconds(20);
  });
  EXPECT_FALSE(waits);
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.errors.find("is a pipe or a device"), std::string::npos) << result.errors;
}

TEST_F(Program, NumbersOfOptionsAreNumbersThatFit) {
  const std::string file = folder_.file("tiny.yaml");
  const std::vector<std::vector<std::string>> all = {
      {"inspect", file, "--seconds", "nan"},  {"chart", file, "--seconds", "nan"},
      {"chart", file, "--error", "inf"},      {"chart", file, "--steps", "0.1,0"},
      {"stability", file, "--widths", "nan"}, {"render", file, "--seed", "9223372036854775808"},
      {"run", file, "--seed", "-1"},          {"run", file, "--seed", "1.5"}};
  for (const auto& arguments : all) {
    const Result result = run(arguments);
    EXPECT_EQ(result.status, 2) << arguments[2];
    EXPECT_NE(result.errors.find(arguments[2] + ": "), std::string::npos) << result.errors;
  }
  EXPECT_EQ(
      run({"render", file, "-o", folder_.file("out"), "--no-plots", "--quiet", "--seed", "9223372036854775807"}).status,
      0);
}

/// Whether a warning names the shortest and the longest of a few paths of the tiny scene: about 4 and 9 units, by the random
/// numbers.
bool names_lengths(const std::string& errors, double units) {
  const std::string before = "paths with light are about ";
  const std::size_t at = errors.find(before);
  double least = 0, most = 0;
  if (at == std::string::npos || std::sscanf(errors.c_str() + at + before.size(), "%lf to %lf", &least, &most) != 2)
    return false;
  return least > 3.5 * units && least < 5 * units && most > 7 * units && most < 13 * units;
}

TEST_F(Program, GatesInTheWrongUnitAreNamed) {
  // Nanoseconds taken for scene units; the second gate of three happens to be right.
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  const Result result = run({"render", file, "-o", out, "--no-plots", "--quiet", "--set", "gates.centers=[20, 5, 30]"});
  EXPECT_EQ(result.status, 0);
  EXPECT_NE(result.errors.find("no light reaches gates 0, 2 of 3 of the image; paths"), std::string::npos)
      << result.errors;
  EXPECT_TRUE(names_lengths(result.errors, 1)) << result.errors;
  EXPECT_NE(result.errors.find(" scene units long; their centres are 20 to 30\n"), std::string::npos);
  const Result in_ps = run({"render", file, "-o", out, "--no-plots", "--quiet", "--set", "gates.unit=ps", "--set",
                            "gates.scene_unit_m=0.299792458", "--set", "gates.sigma=10"});
  EXPECT_TRUE(names_lengths(in_ps.errors, 1000)) << in_ps.errors;
  EXPECT_NE(in_ps.errors.find(" ps long"), std::string::npos) << in_ps.errors;
}

TEST_F(Program, ValuesThatOverflowAreNoResult) {
  const std::string file = folder_.file("tiny.yaml"), out = folder_.file("out");
  for (const char* command : {"render", "derive", "gradient", "check"}) {
    const Result result =
        run({command, file, "-o", out, "--no-plots", "--at", "power=1e308", "--set", "target.samples=2"});
    EXPECT_EQ(result.status, 1) << command << result.errors;
    EXPECT_EQ(result.errors.find("nan"), std::string::npos) << result.errors;
  }
  EXPECT_FALSE(folder_.has("out/render.exr"));
  EXPECT_FALSE(folder_.has("out/render.csv"));
  const Result narrow = run({"render", file, "-o", out, "--no-plots", "--set", "gates.sigma=1e-300"});
  EXPECT_EQ(narrow.status, 2);
  EXPECT_NE(narrow.errors.find("are below the rounding of path lengths"), std::string::npos) << narrow.errors;
}

TEST_F(Program, OutputThatCannotBeWrittenIsAFailure) {
  const auto shell = [&](const std::string& command) {
    const int status = std::system(("cd " + folder_.path() + " && " + command + " 2>stderr").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  const std::string program = ISOCHRON_PROGRAM;
  for (const std::string& command :
       {std::string("check tiny.yaml -o out --samples 8"), std::string("inspect tiny.yaml -o out --seconds 0.2"),
        std::string("--help"), std::string("run --help"), std::string("--version")}) {
    EXPECT_EQ(shell(program + " " + command + " >/dev/full"), 1) << command;
    EXPECT_NE(folder_.read("stderr").find("isochron: error: "), std::string::npos) << folder_.read("stderr");
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    ::close(ends[0]);
    ::dup2(ends[1], 9);  // a shell's redirections name descriptors of one digit
    ::close(ends[1]);
    EXPECT_EQ(shell(program + " " + command + " >&9"), 1) << command;
    ::close(9);
  }
  EXPECT_TRUE(folder_.has("out/check.csv"));
}

TEST_F(Program, GatesThatNoPathReaches) {
  // Zeros everywhere, and a run that has nothing to go by stays where it is and ends as it should.
  const std::string file = folder_.file("tiny.yaml");
  const auto expect_dark = [](const Result& result) {
    EXPECT_NE(result.errors.find("no light reaches the gates of the "), std::string::npos) << result.errors;
    EXPECT_TRUE(names_lengths(result.errors, 1)) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  };
  for (const char* sampling : {"standard", "ellipsoidal", "auto"}) {
    const std::vector<std::string> change = {"--set", "gates.centers=[90, 0.1]", "--set",
                                             std::string("estimator.sampling=") + sampling};
    const auto with = [&](std::vector<std::string> arguments) {
      arguments.insert(arguments.end(), change.begin(), change.end());
      return arguments;
    };
    const std::string out = folder_.file(sampling);
    const Result render = run(with({"render", file, "-o", out, "--no-plots", "--quiet"}));
    EXPECT_EQ(render.status, 0);
    expect_dark(render);
    const std::string replicates = sampling == std::string("standard") ? "2" : "8";
    EXPECT_EQ(
        folder_.read(sampling + std::string("/render.csv")),
        "gate,mean,standard_error,replicates,degrees_of_freedom,effective_count,half_width_95,gate_center\n0,0,0," +
            replicates + ",inf,inf,0,90\n1,0,0," + replicates + ",inf,inf,0,0.1\n");
    const Result derive = run(with({"derive", file, "-o", out, "--no-plots", "--quiet"}));
    EXPECT_EQ(derive.status, 0);
    expect_dark(derive);
    std::istringstream rows(folder_.read(sampling + std::string("/derive.csv")));
    std::string row;
    std::getline(rows, row);
    while (std::getline(rows, row)) EXPECT_NE(row.find(",0,0,"), std::string::npos) << row;
    const Result gradient = run(with({"gradient", file, "-o", out, "--quiet"}));
    EXPECT_EQ(gradient.status, 0);
    expect_dark(gradient);
    const Result check = run(with({"check", file, "-o", out, "--quiet"}));
    EXPECT_EQ(check.status, 1);
    EXPECT_NE(check.errors.find("no light reaches the gates of the image"), std::string::npos) << check.errors;
    EXPECT_NE(check.errors.find("nothing was checked"), std::string::npos) << check.errors;
    EXPECT_EQ(
        folder_.read(sampling + std::string("/gradient.csv")),
        "parameter,value,gradient,standard_error,degrees_of_freedom,effective_count,half_width_95\nheight,0.2,0,0,inf,"
        "inf,0\npower,8,0,0,inf,inf,0\n");
    const Result inspection = run(with({"inspect", file, "-o", out, "--seconds", "0.5"}));
    EXPECT_EQ(inspection.status, 1);
    EXPECT_NE(inspection.errors.find("nothing to advise"), std::string::npos) << inspection.errors;
    const std::string folder = std::string("run_") + sampling;
    const Result fitted = run(with(run_command(folder)));
    EXPECT_EQ(fitted.status, 0);
    expect_dark(fitted);
    const std::string summary = folder_.read(folder + "/summary.yaml");
    for (const char* line : {"status: iterations_reached\n", "loss_final: 0\n", "height: 0.2\n", "power: 8\n"})
      EXPECT_NE(summary.find(line), std::string::npos) << line << summary;
    EXPECT_EQ(folder_.read(folder + "/log.csv").find("nan"), std::string::npos);
  }
}

}  // namespace
}  // namespace isochron
