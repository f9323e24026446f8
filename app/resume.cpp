#include "app/commands.h"
#include "app/execute_run.h"

namespace isochron {
namespace {

int resume(const CommonOptions& options) {
  begin_session(options);
  return execute_run(options.file, options, false, resume_run);
}

}  // namespace

void add_resume(CLI::App& app, Action& action) {
  auto options = std::make_shared<CommonOptions>();
  CLI::App* sub = app.add_subcommand("resume", "Continue from a run's last checkpoint, to the same result bit for bit");
  sub->add_option("folder", options->file, "folder of the run")->required()->type_name("DIR");
  add_session_options(*sub, *options);
  sub->footer(
      "Examples:\n"
      "  isochron resume runs/cube\n"
      "  isochron resume runs/cube --threads 2 --quiet");
  sub->callback([&action, options] { action = [options] { return resume(*options); }; });
}

}  // namespace isochron
