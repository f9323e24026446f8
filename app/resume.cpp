#include "app/commands.h"
#include "app/execute_run.h"

namespace isochron {
namespace {

int resume(const CommonOptions& options) {
  begin_session(options);
  return *execute_run(options.file, options, resume_run);
}

}  // namespace

void add_resume(CLI::App& app, Action& action) {
  const auto [sub, options] = add_command(
      app, action, "resume", "Continue from a run's last checkpoint, to the same result bit for bit", resume);
  sub->add_option("folder", options->file, "folder of the run")->required()->type_name("DIR");
  add_session_options(*sub, *options);
  sub->footer(
      "Examples:\n"
      "  isochron resume runs/cube\n"
      "  isochron resume runs/cube --threads 2 --quiet");
}

}  // namespace isochron
