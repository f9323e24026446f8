#include "app/interrupt.h"

#include <csignal>

#include "core/base/progress.h"

namespace isochron {
namespace {

void stop_work(int) {
  request_stop();
}

}  // namespace

void catch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = stop_work;
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() {
  return stop_requested();
}

void poll_interrupt() {
  throw_if_stopped();
}

}  // namespace isochron
