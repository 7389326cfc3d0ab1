#include "hard/limited_run.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "io/temporary_folder.h"

namespace vdb_diffuse {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized =
    true;  // its shadow takes terabytes of address space, and the work ten times as long
#else
constexpr bool kSanitized = false;
#endif

}  // namespace

LimitedRun runLimited(const std::vector<std::string>& words, const std::string& folder,
                      const RunLimits& limits) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  const std::string out = folder + "/out", error = folder + "/error";
  const unsigned seconds = (kSanitized ? 10 : 1) * limits.seconds;
  const pid_t child = ::fork();
  if (child == 0) {  // only what is safe in a copy of one thread of several
    const rlimit memory{limits.bytes, limits.bytes}, none{0, 0}, time{seconds, seconds};
    ::setrlimit(RLIMIT_CPU, &time);
    if (!kSanitized) ::setrlimit(RLIMIT_AS, &memory);
    ::setrlimit(RLIMIT_CORE, &none);
    ::dup2(::open("/dev/null", O_RDONLY), 0);
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 1);
    ::dup2(::open(error.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), 2);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  LimitedRun result;
  const auto start = std::chrono::steady_clock::now();
  rusage usage{};
  while (::wait4(child, &result.status, WNOHANG, &usage) == 0) {
    ::usleep(500);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (elapsed.count() < 6 * seconds || result.hung) continue;
    result.hung = true;
    ::kill(child, SIGKILL);
  }
  result.hung = result.hung || (WIFSIGNALED(result.status) &&
                                usage.ru_utime.tv_sec + usage.ru_stime.tv_sec + 1 >= long{seconds});
  result.peak_kilobytes = usage.ru_maxrss;
  result.out = contentsOf(out);
  result.error = contentsOf(error);
  return result;
}

std::string verdictOf(const LimitedRun& run, const std::string& named, const std::string& output) {
  if (run.hung) return "hung";
  if (!WIFEXITED(run.status)) return "crashed";
  const int status = WEXITSTATUS(run.status);
  const bool written = std::filesystem::exists(output);
  if (run.error.find("memory") != std::string::npos && status == 5) return "out of memory";
  if (status == 3 && written) return "refused and written";
  if (status == 3) {
    const bool one_line = std::count(run.error.begin(), run.error.end(), '\n') == 1;
    return one_line && run.error.find(named) != std::string::npos ? "refused" : "refused unclearly";
  }
  if (status != 0 && status != 4) return "status " + std::to_string(status);
  for (const char* number : {" nan", " -nan", " inf"})  // of the residual or the energy balance
    if (run.out.find(std::string(number) + ",") != std::string::npos) return "not finite";
  return status == 4 ? "accepted, not converged" : "accepted";
}

}  // namespace vdb_diffuse
