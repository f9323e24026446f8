// The program: parses the command line, runs one command, turns exceptions into messages and exit statuses
// (0: done, 1: failed, 2: the input cannot be used).
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <new>
#include <string>

#include "app/commands.h"
#include "app/progress.h"
#include "core/math/error.h"
#include "core/render/parallel.h"
#include "core/render/progress.h"

namespace {

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  isochron::keep_freed_memory();
  spdlog::set_default_logger(spdlog::stderr_color_mt("isochron"));
  spdlog::set_pattern("%n: %^%l%$: %v");
  isochron::keep_messages_off_the_bar();
  CLI::App app("Differentiable time-gated rendering and optimisation", "isochron");
  app.set_version_flag("--version", "isochron " ISOCHRON_VERSION);
  app.require_subcommand(1);
  app.footer("Examples:\n  isochron run cube.yaml\n  isochron render cube.yaml --at target\n  isochron run --help");
  isochron::Action action;
  isochron::add_run(app, action);
  isochron::add_resume(app, action);
  isochron::add_render(app, action);
  isochron::add_derive(app, action);
  isochron::add_gradient(app, action);
  isochron::add_check(app, action);
  isochron::add_inspect(app, action);
  isochron::add_chart(app, action);
  isochron::add_stability(app, action);
  try {
    app.parse(argc, argv);
    return action();
  } catch (const CLI::Success& request) {
    return app.exit(request);
  } catch (const CLI::ParseError& error) {
    spdlog::error("{} (see isochron --help)", one_line(error.what()));
    return 2;
  } catch (const isochron::InputError& error) {
    spdlog::error("{}", one_line(error.what()));
    return 2;
  } catch (const isochron::Interrupted&) {
    spdlog::error("interrupted, nothing more was written");
    return 1;
  } catch (const std::bad_alloc&) {
    spdlog::error("out of memory: lower resolution, the number of gates or unknowns, or threads");
    return 1;
  } catch (const std::exception& error) {
    spdlog::error("{}", one_line(error.what()));
    return 1;
  }
}
