#include "app/plots.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <vector>

#include "app/interrupt.h"
#include "app/package_folder.h"

extern char** environ;

namespace isochron {
namespace {

/// The last line that holds text: where Python names the error.
std::string last_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

/// This process's environment, with the package isochron where Python looks first.
std::vector<std::string> environment_with_package() {
  constexpr std::string_view kVariable = "PYTHONPATH=";
  std::vector<std::string> variables;
  std::string path = std::string(kVariable) + package_folder();
  for (char** variable = environ; *variable; ++variable) {
    if (std::string_view(*variable).starts_with(kVariable)) {
      path += std::string(":") + (*variable + kVariable.size());
    } else {
      variables.emplace_back(*variable);
    }
  }
  variables.push_back(path);
  return variables;
}

/// Runs a module of the package isochron with a folder as its argument.
bool run_module(const std::string& module, const std::string& folder) {
  // A folder named -x must not be taken for an option.
  const std::string argument = folder.front() == '-' ? "./" + folder : folder;
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    spdlog::warn("plots: cannot start: {}", std::strerror(errno));
    return false;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::array<const char*, 5> arguments = {"/usr/bin/python3", "-m", module.c_str(), argument.c_str(), nullptr};
  const std::vector<std::string> variables = environment_with_package();
  std::vector<const char*> environment;
  for (const std::string& variable : variables) environment.push_back(variable.c_str());
  environment.push_back(nullptr);
  pid_t child = 0;
  const int error = posix_spawn(&child, arguments[0], &actions, nullptr, const_cast<char* const*>(arguments.data()),
                                const_cast<char* const*>(environment.data()));
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string messages;
  if (error == 0) {
    constexpr int kPause = 100;  // milliseconds between looks at whether the user wants to stop
    std::array<char, 4096> buffer;
    for (pollfd ready{ends[0], POLLIN, 0};;) {
      const int count = poll(&ready, 1, kPause);
      if (interrupted()) kill(child, SIGTERM);
      if (count <= 0) continue;
      const ssize_t n = read(ends[0], buffer.data(), buffer.size());
      if (n > 0) messages.append(buffer.data(), static_cast<std::size_t>(n));
      if (n == 0 || (n < 0 && errno != EINTR)) break;
    }
  }
  close(ends[0]);
  if (error != 0) {
    spdlog::warn("plots: cannot start {}: {}", arguments[0], std::strerror(error));
    return false;
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
  if (interrupted()) {
    spdlog::warn("plots: interrupted; draw them with: isochron plot {}", argument);
    return false;
  }
  spdlog::warn("plots: {} failed: {}", module, last_line(messages));
  return false;
}

}  // namespace

bool draw_plots(const std::string& folder) {
  return run_module("isochron.plot", folder);
}

bool draw_charts(const std::string& folder) {
  return run_module("isochron.plot_chart", folder);
}

}  // namespace isochron
