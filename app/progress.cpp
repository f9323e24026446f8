#include "app/progress.h"

#include <fmt/format.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>

#include "core/base/progress.h"
#include "core/base/ranks.h"

namespace isochron {
namespace {

constexpr auto kRedraw = std::chrono::milliseconds(100), kFirstLine = std::chrono::milliseconds(2000),
               kNextLines = std::chrono::milliseconds(5000);
constexpr int kBarWidth = 24;

std::mutex bar_mutex;
bool bar_shown = false;
int messages = 0;  ///< being written, the bar stays away from

std::string duration(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  const auto total = static_cast<long long>(seconds);
  if (total < 3600) return fmt::format("{} min {:02} s", total / 60, total % 60);
  return fmt::format("{} h {:02} min", total / 3600, total / 60 % 60);
}

void clear_bar() {
  if (bar_shown) std::fputs("\r\x1b[K", stderr);
  bar_shown = false;
}

/// Before the sink that writes messages and, with `change` -1, after it.
class BarGuard : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit BarGuard(int change) : change_(change) {}

 private:
  void sink_it_(const spdlog::details::log_msg&) override {
    const std::lock_guard lock(bar_mutex);
    messages += change_;
    clear_bar();
    std::fflush(stderr);
  }
  void flush_() override {}
  int change_;
};

}  // namespace

void keep_messages_off_the_bar() {
  auto& sinks = spdlog::default_logger()->sinks();
  sinks.insert(sinks.begin(), std::make_shared<BarGuard>(1));
  sinks.push_back(std::make_shared<BarGuard>(-1));
}

ProgressDisplay::ProgressDisplay(bool quiet) : terminal_(isatty(STDERR_FILENO) == 1), ended_(quiet || !first_rank()) {
  if (!ended_) thread_ = std::thread([this] { watch(); });
}

ProgressDisplay::~ProgressDisplay() {
  end();
}

void ProgressDisplay::end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ProgressDisplay::show(const Progress& p) {
  const std::string error = std::isnan(p.param_rmse) ? "" : fmt::format("  parameter error {:.4g}", p.param_rmse);
  const std::string level = p.levels > 0 ? fmt::format("level {}/{}  ", p.level, p.levels) : "";
  const std::lock_guard lock(mutex_);
  run_ = fmt::format("{}iteration {}/{}  loss {:.4g}{}  {:.3g} s each  {} left", level, p.iteration, p.iterations,
                     p.loss, error, p.seconds_per_iteration, duration(p.seconds_left));
}

std::string ProgressDisplay::line(bool bar) const {
  const auto work = work_progress();
  if (!work) return run_;
  std::string text = run_;
  if (text.empty()) {
    text = fmt::format("{}: {:.0f} %", work->name, 100 * work->fraction);
    // No estimate before a fiftieth is done.
    if (work->fraction > 0.02)
      text += fmt::format(", {} left", duration(work->seconds * (1 - work->fraction) / work->fraction));
  }
  if (!bar) return text;
  const int filled = static_cast<int>(std::lround(kBarWidth * work->fraction));
  return fmt::format("[{}{}] {}", std::string(filled, '#'), std::string(kBarWidth - filled, '.'), text);
}

void ProgressDisplay::watch() {
  std::unique_lock lock(mutex_);
  for (auto pause = terminal_ ? kRedraw : kFirstLine; !wake_.wait_for(lock, pause, [this] { return ended_; });
       pause = terminal_ ? kRedraw : kNextLines) {
    const std::string text = line(terminal_);
    if (text.empty()) continue;
    const std::lock_guard bar_lock(bar_mutex);
    if (messages > 0) continue;
    clear_bar();
    fmt::print(stderr, "{}{}", text, terminal_ ? "" : "\n");
    std::fflush(stderr);
    bar_shown = terminal_;
  }
  const std::lock_guard bar_lock(bar_mutex);
  clear_bar();
  std::fflush(stderr);
}

}  // namespace isochron
