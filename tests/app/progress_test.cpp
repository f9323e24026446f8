// Interruptions, progress and memory, as the program's user meets them.
#include <chrono>

#include "tests/app/program.h"

namespace isochron {
namespace {

using Clock = std::chrono::steady_clock;

class Interruptions : public Program {
 protected:
  /// Seconds from SIGINT, sent `after` seconds after the start, to the end; expects exit status 1.
  double seconds_to_stop(std::vector<std::string> arguments, double after) {
    const auto start = Clock::now();
    auto sent = start;
    const Result result = run(std::move(arguments), SIGINT, [&] {
      sent = Clock::now();
      return std::chrono::duration<double>(sent - start).count() > after;
    });
    EXPECT_EQ(result.status, 1) << result.errors;
    EXPECT_NE(result.errors.find("interrupted"), std::string::npos) << result.errors;
    return std::chrono::duration<double>(Clock::now() - sent).count();
  }
  std::vector<std::string> command(const std::string& name, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {name, folder_.file("tiny.yaml"), "-o", folder_.file("out"), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  // 0.2 s and what a machine with all its cores taken may add; a pass without polls takes minutes.
  static constexpr double kAtOnce = 1.0;
  const std::vector<std::string> many_ = {"--samples", "3000000"};
};

TEST_F(Interruptions, EndEveryCommandAtOnce) {
  for (const char* name : {"render", "derive", "check"})
    EXPECT_LT(seconds_to_stop(command(name, many_), 1), kAtOnce) << name;
  EXPECT_LT(seconds_to_stop(command("gradient", {"--set", "samples.primal=3000000"}), 1), kAtOnce);
  for (const char* name : {"inspect", "chart", "stability"})
    EXPECT_LT(seconds_to_stop(command(name, {"--seconds", "600", "--no-plots"}), 1), kAtOnce) << name;
  EXPECT_FALSE(folder_.has("out/render.exr"));
  EXPECT_FALSE(folder_.has("out/derive.csv"));
}

TEST_F(Interruptions, EndARunWhileItsTargetIsRendered) {
  EXPECT_LT(seconds_to_stop(run_command("slow", {"--set", "target.samples=100000000"}), 1), kAtOnce);
  EXPECT_TRUE(folder_.has("slow/checkpoint.yaml"));
  EXPECT_FALSE(folder_.has("slow/target.exr"));
}

TEST_F(Interruptions, EndARunWithinAnIteration) {
  EXPECT_LT(seconds_to_stop(run_command("slow", {"--set", "samples.interior=100000000"}), 2), kAtOnce);
  EXPECT_NE(folder_.read("slow/checkpoint.yaml").find("iteration: 0\n"), std::string::npos);
}

TEST_F(Program, SaysHowFarItIsEveryFewSeconds) {
  const auto start = Clock::now();
  const Result result = run({"render", folder_.file("tiny.yaml"), "-o", folder_.file("out"), "--samples", "30000000"},
                            SIGINT, [&] { return std::chrono::duration<double>(Clock::now() - start).count() > 3.5; });
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.errors.find("rendering the image: "), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find(" %"), std::string::npos) << result.errors;
  EXPECT_EQ(result.errors.find('\r'), std::string::npos);  // no terminal
}

TEST_F(Program, RefusesWhatDoesNotFitIntoMemory) {
  const std::string large = "resolution=[30000, 30000]";
  for (const char* name : {"render", "derive", "gradient", "check", "run"}) {
    const Result result = run({name, folder_.file("tiny.yaml"), "-o", folder_.file("out"), "--set", large, "--set",
                               "gates={kind: gaussian, centers: {start: 4, stop: 6, count: 1000}, sigma: 0.3}"});
    EXPECT_EQ(result.status, 2) << name;
    EXPECT_NE(result.errors.find("GB of memory for 30000 x 30000 pixels, 1000 gates"), std::string::npos)
        << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_FALSE(folder_.has("out"));
  }
}

TEST_F(Program, OutOfMemoryIsOneLine) {
  // The limit lies above what the images are estimated to need (72 MB), below what they and the libraries' threads take.
  // Where exactly differs between machines: somewhere in this range memory ends while work is under way.
  folder_.write("limited.sh", "ulimit -v $1; shift; exec \"$@\"");
  int failed = 0;
  for (int megabytes = 150; megabytes <= 500 && failed == 0; megabytes += 25) {
    const std::string command = "sh " + folder_.file("limited.sh") + " " + std::to_string(1000 * megabytes) +
                                " " ISOCHRON_PROGRAM " render " + folder_.file("tiny.yaml") + " -o " +
                                folder_.file("out") +
                                " --no-plots --quiet --threads 1 --samples 2 --set 'resolution=[1000, 1000]' --set "
                                "estimator.sampling=standard 2> " +
                                folder_.file("errors");
    const int status = std::system(command.c_str());
    ASSERT_TRUE(WIFEXITED(status)) << megabytes;
    const std::string errors = folder_.read("errors");
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), WEXITSTATUS(status) == 0 ? 0 : 1) << errors;
    failed += errors.find("out of memory") != std::string::npos;
  }
  EXPECT_GT(failed, 0);
}

}  // namespace
}  // namespace isochron
