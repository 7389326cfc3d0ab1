#include "interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>

#include "grid/error.h"
#include "io/atomic_file.h"

namespace vdb_diffuse {
namespace {

std::atomic<bool> interrupted{false};  // the one state that a signal handler can share with the work
static_assert(std::atomic<bool>::is_always_lock_free);

void onInterrupt(int) {
  if (!interrupted.exchange(true)) return;
  removeTemporaryFiles();
  ::_exit(static_cast<int>(ExitStatus::kInterrupted));
}

void onTerminate(int signal) {
  removeTemporaryFiles();
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

}  // namespace

void catchSignals() {
  ::signal(SIGINT, onInterrupt);
  ::signal(SIGTERM, onTerminate);
  if (::signal(SIGHUP, onTerminate) == SIG_IGN) ::signal(SIGHUP, SIG_IGN);  // nohup stays in force
  ::signal(SIGXFSZ, SIG_IGN);
}

void throwIfInterrupted() {
  if (interrupted) throw Interrupted();
}

}  // namespace vdb_diffuse
