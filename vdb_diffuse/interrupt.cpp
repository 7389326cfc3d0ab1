#include "interrupt.h"

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>

#include "grid/error.h"
#include "io/atomic_file.h"

namespace vdb_diffuse {
namespace {

std::atomic<bool> interrupted{false};  // the one state that a signal handler can share with the work
static_assert(std::atomic<bool>::is_always_lock_free);

timer_t grace;
bool has_grace = false;
constexpr long kGraceNanoseconds = 500'000'000;

/// Ends the process at once, whatever its threads are doing: no file of theirs is in its place yet.
void endNow() {
  removeTemporaryFiles();
  constexpr char kLine[] = "vdb_diffuse: interrupted\n";
  (void)!::write(STDERR_FILENO, kLine, sizeof kLine - 1);
  ::_exit(static_cast<int>(ExitStatus::kInterrupted));
}

void onInterrupt(int) {
  if (interrupted.exchange(true) || !has_grace) endNow();
  itimerspec time{};
  time.it_value.tv_nsec = kGraceNanoseconds;
  ::timer_settime(grace, 0, &time, nullptr);
}

void onEndOfGrace(int) {
  endNow();
}

void onTerminate(int signal) {
  removeTemporaryFiles();
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

/// Where no one can catch: trees of OpenVDB take memory in their destructors, which may be what there is none
/// of.
[[noreturn]] void onUncaught() {
  removeTemporaryFiles();
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    constexpr char kLine[] = "vdb_diffuse: not enough memory; free some, or use a smaller volume\n";
    (void)!::write(STDERR_FILENO, kLine, sizeof kLine - 1);
    ::_exit(static_cast<int>(ExitStatus::kOutputNotWritten));
  } catch (...) {
  }
  std::abort();
}

}  // namespace

void catchSignals() {
  std::set_terminate(onUncaught);
  ::signal(SIGALRM, onEndOfGrace);
  sigevent alarm{};
  alarm.sigev_notify = SIGEV_SIGNAL;
  alarm.sigev_signo = SIGALRM;
  has_grace = ::timer_create(CLOCK_MONOTONIC, &alarm, &grace) == 0;
  ::signal(SIGINT, onInterrupt);
  ::signal(SIGTERM, onTerminate);
  if (::signal(SIGHUP, onTerminate) == SIG_IGN) ::signal(SIGHUP, SIG_IGN);  // nohup stays in force
  ::signal(SIGXFSZ, SIG_IGN);
}

void throwIfInterrupted() {
  if (interrupted) throw Interrupted();
}

}  // namespace vdb_diffuse
