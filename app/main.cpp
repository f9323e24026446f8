// The program: parses the command line, runs one command, turns exceptions into messages and exit statuses
// (0: done, 1: failed, 2: the input cannot be used).
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "app/commands.h"
#include "app/man_pages.h"
#include "app/progress.h"
#include "app/start_ranks.h"
#include "core/base/error.h"
#include "core/base/large_blocks.h"
#include "core/base/progress.h"
#include "core/base/ranks.h"
#include "core/base/yaml_reader.h"
#include "core/image/hdf5_file.h"
#include "optim/problem/problem.h"

namespace {

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string not_among(const std::string& word, const std::string& what, const std::vector<std::string>& known) {
  const std::string near = isochron::nearest_word(word, known);
  return fmt::format("{} is not {}{}", isochron::quote(word), what,
                     near.empty() ? "" : fmt::format(", did you mean '{}'?", near));
}

/// A mistyped command or option, and the one that is probably meant; empty where there is none.
std::string mistyped(const CLI::App* command, const std::vector<std::string>& commands,
                     const std::vector<std::string>& words) {
  if (words.empty() || words[0][0] == '-') return {};
  if (!command) return not_among(words[0], "a command", commands);
  std::vector<std::string> options;
  for (const CLI::Option* option : command->get_options())
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    if (name.starts_with("--") && std::find(options.begin(), options.end(), name) == options.end())
      return not_among(name, "an option of " + words[0], options);
  }
  return {};
}

/// What is wrong with a command line, in one line.
std::string complaint(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
  std::vector<std::string> commands;
  const CLI::App* command = nullptr;
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; })) {
    commands.push_back(each->get_name());
    if (!words.empty() && words[0] == each->get_name()) command = each;
  }
  const std::string known = mistyped(command, commands, words);
  return fmt::format("{} (see isochron {}--help)", known.empty() ? one_line(error.what()) : known,
                     command ? words[0] + " " : "");
}

/// Reports what of the standard output could not be written, as on a full disk; status 1 then.
int flushed(int status) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) return status;
  spdlog::error("the standard output cannot be written");
  return status == 0 ? 1 : status;
}

int run_program(int argc, char** argv) {
  isochron::keep_freed_memory();
  isochron::end_without_hdf5();
  std::signal(SIGPIPE, SIG_IGN);                  // a closed pipe is an error of its write
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // tables and messages stay in order where both go to one file
  spdlog::set_default_logger(spdlog::stderr_color_mt("isochron"));
  spdlog::set_pattern("%n: %^%l%$: %v");
  isochron::keep_messages_off_the_bar();
  CLI::App app("Inverse rendering for time-of-flight imaging: gated images, their derivatives, reconstructions",
               "isochron");
  app.set_version_flag("--version", "isochron " ISOCHRON_VERSION);
  app.require_subcommand(1);
  app.footer("Examples:\n  isochron run cube.yaml\n  isochron render cube.yaml --at target\n  isochron run --help");
  isochron::Action action;
  using namespace isochron;
  for (const auto add : {add_run, add_reconstruct, add_resume, add_report, add_render, add_derive, add_gradient,
                         add_check, add_inspect, add_chart, add_stability, add_plot})
    add(app, action);
  isochron::add_man_pages_option(app);
  try {
    isochron::start_ranks();
    app.parse(argc, argv);
    return flushed(action());
  } catch (const CLI::Success& request) {
    return flushed(app.exit(request));
  } catch (const CLI::ParseError& error) {
    spdlog::error("{}", complaint(app, error, {argv + 1, argv + argc}));
    return 2;
  } catch (const isochron::InputError& error) {
    spdlog::error("{}", one_line(error.what()));
    return 2;
  } catch (const isochron::Interrupted&) {
    spdlog::error("interrupted, nothing more was written");
    return 1;
  } catch (const isochron::SharedError& error) {
    spdlog::error("{}", one_line(error.what()));
    return 1;
  } catch (const std::bad_alloc&) {
    return isochron::fail_alone("out of memory: lower resolution, the number of gates or unknowns, or threads");
  } catch (const std::exception& error) {
    return isochron::fail_alone(one_line(error.what()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  return isochron::end_ranks(run_program(argc, argv));
}
