#include <spdlog/spdlog.h>

#include "app/commands.h"
#include "app/final_derivatives.h"
#include "app/interrupt.h"
#include "app/plots.h"

namespace isochron {
namespace {

struct ReportCommand {
  std::vector<std::string> folders;
  std::string output;
  CommonOptions session;
  bool no_derivatives = false;
};

int report(const ReportCommand& command) {
  begin_session(command.session);
  catch_interrupts();
  if (!command.no_derivatives && command.folders.size() == 1) try_final_derivatives(command.folders[0]);
  std::vector<std::string> arguments = command.folders;
  if (!command.output.empty()) arguments.insert(arguments.end(), {"--output", command.output});
  return run_report(arguments);
}

}  // namespace

void add_report(CLI::App& app, Action& action) {
  const auto [sub, command] =
      add_command(app, action, "report", "Write a page about a run, or a comparison of several", report);
  sub->add_option("folders", command->folders, "folders of runs, finished or not")->required()->type_name("DIR...");
  sub->add_option("-o,--output", command->output,
                  "the page; default DIR/report.html, for several runs comparison.html in the current folder")
      ->type_name("FILE");
  sub->add_flag("--no-derivatives", command->no_derivatives,
                "render no derivative images at the final parameters (about two seconds, once)");
  sub->add_option("--threads", command->session.threads, "threads; 0: all cores")
      ->check(CLI::Range(0, 4096))
      ->type_name("N");
  sub->add_flag("--quiet", command->session.quiet, "only warnings and errors");
  sub->footer(
      "Examples:\n"
      "  isochron report runs/cube\n"
      "  isochron report runs/cube runs/cube_standard -o comparison.html");
}

}  // namespace isochron
