#pragma once

namespace isochron {

/// From now on the first SIGINT or SIGTERM only raises a flag; the second ends the program at once.
void catch_interrupts();
bool interrupted();
/// Throws Interrupted once the flag is up. A Poll.
void poll_interrupt();

}  // namespace isochron
