#pragma once

namespace isochron {

/// From now on the first SIGINT or SIGTERM requests a stop (core/base/progress.h): work under way ends by Interrupted,
/// renderers within a sample. The second ends the program at once.
void catch_interrupts();

}  // namespace isochron
