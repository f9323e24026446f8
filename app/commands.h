// One function per command: declares it on the command line and sets `action` when it is chosen.
#pragma once
#include <CLI/CLI.hpp>
#include <memory>
#include <utility>

#include "app/options.h"

namespace isochron {

/// A command that calls `run`, and what its options are to be read into.
template <class Options>
std::pair<CLI::App*, std::shared_ptr<Options>> add_command(CLI::App& app, Action& action, const char* name,
                                                           const char* meaning, int (*run)(const Options&)) {
  auto options = std::make_shared<Options>();
  CLI::App* const command = app.add_subcommand(name, meaning);
  command->callback([&action, options, run] { action = [options, run] { return run(*options); }; });
  return {command, options};
}

void add_run(CLI::App& app, Action& action);
void add_reconstruct(CLI::App& app, Action& action);
void add_resume(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);
void add_render(CLI::App& app, Action& action);
void add_derive(CLI::App& app, Action& action);
void add_gradient(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_inspect(CLI::App& app, Action& action);
void add_chart(CLI::App& app, Action& action);
void add_stability(CLI::App& app, Action& action);
void add_plot(CLI::App& app, Action& action);

}  // namespace isochron
