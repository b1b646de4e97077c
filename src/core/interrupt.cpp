#include "core/interrupt.h"

#include <csignal>

namespace pilesim {
namespace {
volatile std::sig_atomic_t g_interrupted = 0;

void on_signal(int signal) {
  g_interrupted = 1;
  // A terminal that closes may say so twice, by itself and by its shell.
  if (signal != SIGHUP) std::signal(signal, SIG_DFL);
}
}  // namespace

void install_interrupt_handler() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // What the parent has switched off, as nohup does, stays off.
    if (std::signal(signal, on_signal) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
}

bool interrupted() { return g_interrupted != 0; }

}  // namespace pilesim
