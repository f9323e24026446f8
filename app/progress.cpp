#include "app/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

namespace isochron {
namespace {

std::string duration(double seconds) {
  if (seconds < 60) return fmt::format("{:.1f} s", seconds);
  const auto total = static_cast<long long>(seconds);
  if (total < 3600) return fmt::format("{} min {:02} s", total / 60, total % 60);
  return fmt::format("{} h {:02} min", total / 3600, total / 60 % 60);
}

}  // namespace

ProgressLine::ProgressLine(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressLine::~ProgressLine() {
  end();
}

void ProgressLine::show(const Progress& p) {
  if (quiet_) return;
  const std::string error = std::isnan(p.param_rmse) ? "" : fmt::format("  parameter error {:.4g}", p.param_rmse);
  const std::string text = fmt::format("iteration {}/{}  loss {:.4g}{}  {:.3g} s each  {} left", p.iteration,
                                       p.iterations, p.loss, error, p.seconds_per_iteration, duration(p.seconds_left));
  if (terminal_)
    fmt::print(stderr, "\r\x1b[K{}", text);
  else
    fmt::print(stderr, "{}\n", text);
  std::fflush(stderr);
  open_ = terminal_;
}

void ProgressLine::end() {
  if (open_) fmt::print(stderr, "\n");
  open_ = false;
}

}  // namespace isochron
