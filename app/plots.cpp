#include "app/plots.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <future>
#include <string_view>
#include <vector>

#include "app/final_derivatives.h"
#include "app/installation.h"
#include "core/base/progress.h"
#include "core/base/ranks.h"

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

/// How a module of the package isochron ended.
struct ModuleResult {
  int status = -1;      ///< of its exit; -1 where it could not start, or was stopped
  std::string message;  ///< the last line of its standard error
};

/// A folder named -x must not be taken for an option.
std::string as_path(const std::string& folder) {
  return folder.starts_with('-') ? "./" + folder : folder;
}

/// Runs a module of the package isochron. -P: files of the current folder are no modules.
ModuleResult run_module(const std::string& module, const std::vector<std::string>& more) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {-1, fmt::format("cannot start: {}", std::strerror(errno))};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::vector<const char*> arguments = {"/usr/bin/python3", "-P", "-m", module.c_str()};
  for (const std::string& argument : more) arguments.push_back(argument.c_str());
  arguments.push_back(nullptr);
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
      if (stop_requested()) kill(child, SIGTERM);
      if (count <= 0) continue;
      const ssize_t n = read(ends[0], buffer.data(), buffer.size());
      if (n > 0) messages.append(buffer.data(), static_cast<std::size_t>(n));
      if (n == 0 || (n < 0 && errno != EINTR)) break;
    }
  }
  close(ends[0]);
  if (error != 0) return {-1, fmt::format("cannot start {}: {}", arguments[0], std::strerror(error))};
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, last_line(messages)};
}

/// Runs a module with a folder as its argument. On failure warns in one line and returns false.
bool draw(const std::string& module, const std::string& folder) {
  const ModuleResult result = run_module(module, {as_path(folder)});
  if (result.status == 0) return true;
  if (stop_requested())
    spdlog::warn("plots: interrupted; draw them with: isochron plot {}", as_path(folder));
  else
    spdlog::warn("plots: {} failed: {}", module, result.message);
  return false;
}

bool write_report(const std::string& folder) {
  try_final_derivatives(folder);
  if (!first_rank()) return true;
  const ModuleResult result = run_module("isochron.report", {as_path(folder)});
  if (result.status == 0) return true;
  if (stop_requested())
    spdlog::warn("report: interrupted; write it with: isochron report {}", folder);
  else
    spdlog::warn("report: failed: {}", result.message);
  return false;
}

}  // namespace

bool draw_plots(const std::string& folder) {
  return !first_rank() || draw("isochron.plot", folder);
}

bool draw_charts(const std::string& folder) {
  return !first_rank() || draw("isochron.plot_chart", folder);
}

bool draw_plots_and_report(const std::string& folder) {
  std::future<bool> drawn = std::async(std::launch::async, [&] { return draw_plots(folder); });
  const bool reported = write_report(folder);
  return drawn.get() && reported;
}

void try_final_derivatives(const std::string& folder) {
  try {
    write_final_derivatives(folder);
  } catch (const Interrupted&) {
  } catch (const std::exception& error) {
    spdlog::warn("report: without derivative images: {}", error.what());
  }
}

int run_report(std::vector<std::string> arguments) {
  if (!first_rank()) return 0;
  for (std::string& argument : arguments)
    if (argument != "--output") argument = as_path(argument);
  const ModuleResult result = run_module("isochron.report", arguments);
  if (result.status == 0)
    spdlog::info("wrote {}", result.message);
  else
    spdlog::error("{}", stop_requested() ? "interrupted, nothing was written" : result.message);
  return result.status < 0 ? 1 : result.status;
}

}  // namespace isochron
