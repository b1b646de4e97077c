// Ctrl-C and a polite kill (SIGINT, SIGTERM): long work asks between frames and stops with what it
// has safe on disk. A second signal ends the process at once.
#pragma once

namespace pilesim {

void install_interrupt_handler();
bool interrupted();

}  // namespace pilesim
