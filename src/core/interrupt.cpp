#include "core/interrupt.h"

#include <csignal>

namespace pilesim {
namespace {
volatile std::sig_atomic_t g_interrupted = 0;

void on_signal(int signal) {
  // A terminal that closes sends SIGHUP twice, by the shell and by the kernel: nobody is impatient.
  if (g_interrupted != 0 && signal != SIGHUP) {
    std::signal(signal, SIG_DFL);
    raise(signal);  // takes effect when this handler returns
  }
  g_interrupted = 1;
}
}  // namespace

void install_interrupt_handler() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // Whoever started pilesim may want a signal ignored: nohup, a shell's background jobs.
    if (std::signal(signal, on_signal) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
}

bool interrupted() { return g_interrupted != 0; }

}  // namespace pilesim
