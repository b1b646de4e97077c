// Ctrl-C, a polite kill and a terminal that closes (SIGINT, SIGTERM, SIGHUP): long work asks
// between frames and stops with its results safe on disk. A second SIGINT or SIGTERM ends the
// process at once; signals that are ignored when the process starts, as SIGHUP is under nohup, stay
// ignored. Installed only where such a loop begins: nobody asks before, and the signal's default
// action, to end the process at once, is right while nothing but renamed files was written.
#pragma once

namespace pilesim {

void install_interrupt_handler();
bool interrupted();

}  // namespace pilesim
