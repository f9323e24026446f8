// Runs the program itself on a tiny experiment.
#pragma once
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "tests/optim/tiny_scene.h"

extern char** environ;

namespace isochron {

struct Result {
  int status;  ///< exit status, or minus the signal
  std::string errors;
};

/// Whether the process handles SIGINT: before it does, which takes a loaded machine a second, the signal just ends it.
inline bool catches_interrupts(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string word; status >> word;)
    if (word == "SigCgt:" && status >> word) return (std::stoull(word, nullptr, 16) >> (SIGINT - 1) & 1) != 0;
  return false;
}

class Program : public testing::Test {
 protected:
  Program() {
    write_tiny_scene(folder_);
    folder_.write("tiny.yaml", tiny_experiment());
  }

  /// Runs `isochron ARGUMENTS...`; sends `signal` as soon as `when` holds, SIGINT when the program handles it, too.
  Result run(std::vector<std::string> arguments, int signal = 0, const std::function<bool()>& when = {}) {
    arguments.insert(arguments.begin(), ISOCHRON_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, folder_.file("stdout").c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, folder_.file("stderr").c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    pid_t child = 0;
    if (posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ) != 0) ADD_FAILURE() << "cannot start";
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    while (signal != 0 && waitpid(child, &status, WNOHANG) == 0) {
      if ((signal != SIGINT || catches_interrupts(child)) && when()) {
        kill(child, signal);
        signal = 0;
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    if (signal == 0) waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), folder_.read("stderr")};
  }

  std::vector<std::string> run_command(const std::string& out, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"run",    folder_.file("tiny.yaml"), "-o", folder_.file(out), "--no-plots",
                                          "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  int rows(const std::string& out) const {
    const std::string log = folder_.read(out + "/log.csv");
    return static_cast<int>(std::count(log.begin(), log.end(), '\n')) - 1;
  }

  /// log.csv without its seconds.
  std::string log(const std::string& out) const {
    std::istringstream lines(folder_.read(out + "/log.csv"));
    std::string line, kept;
    while (std::getline(lines, line)) {
      const std::size_t first = line.find(','), second = line.find(',', first + 1);
      kept += line.substr(0, first) + line.substr(second) + "\n";
    }
    return kept;
  }

  /// Parameters and optimiser state of the last checkpoint, exact.
  std::string state(const std::string& out) const {
    const std::string text = folder_.read(out + "/checkpoint.yaml");
    return text.substr(text.find("parameters:"), text.find("checksum") - text.find("parameters:"));
  }

  void expect_same_run(const std::string& a, const std::string& b) const {
    EXPECT_EQ(log(a), log(b));
    EXPECT_EQ(state(a), state(b));
    for (const char* image : {"/target.exr", "/initial.exr", "/final.exr"})
      EXPECT_TRUE(folder_.read(a + image) == folder_.read(b + image)) << image;
    const auto frames = [&](const std::string& out) {
      std::map<std::string, std::string> found;
      for (const auto& entry : std::filesystem::directory_iterator(folder_.file(out + "/frames")))
        found[entry.path().filename()] = folder_.read(out + "/frames/" + entry.path().filename().string());
      return found;
    };
    EXPECT_TRUE(frames(a) == frames(b));
    EXPECT_NE(folder_.read(b + "/summary.yaml").find("status: iterations_reached"), std::string::npos);
  }

  TemporaryFolder folder_;
};

}  // namespace isochron
