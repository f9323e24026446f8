#include "app/interrupt.h"

#include <csignal>

#include "core/base/progress.h"

namespace isochron {

void catch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = [](int) { request_stop(); };
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace isochron
