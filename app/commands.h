// One function per command: declares it on the command line and sets `action` when it is chosen.
#pragma once
#include <CLI/CLI.hpp>

#include "app/options.h"

namespace isochron {

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
