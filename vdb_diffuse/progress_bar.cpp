#include "progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <mutex>

#include "interrupt.h"

namespace vdb_diffuse {
namespace {

constexpr std::chrono::milliseconds kBetweenSteps(
    100);  // more often than that is unreadable, and slow to print

class Printer {
 public:
  Printer(ProgressMode mode, std::string json_fields) : mode_(mode), json_fields_(std::move(json_fields)) {}
  ~Printer() {
    if (mode_ == ProgressMode::kBar && !phase_.empty()) std::fputs("\r\x1b[K", stderr);
  }
  Printer(const Printer&) = delete;
  Printer& operator=(const Printer&) = delete;

  void step(std::string_view phase, double fraction) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    fraction = std::clamp(fraction, 0.0, 1.0);
    const bool same = phase == phase_;
    if (same && (fraction <= fraction_ || (fraction < 1 && now - printed_ < kBetweenSteps))) return;
    if (!same && !phase_.empty() && fraction_ < 1 && mode_ == ProgressMode::kJson) printJson(1);
    phase_ = phase;
    fraction_ = fraction;
    printed_ = now;
    if (mode_ == ProgressMode::kJson) {
      printJson(fraction);
    } else {
      constexpr int kWidth = 40;
      const int filled = static_cast<int>(fraction * kWidth);
      std::fprintf(stderr, "\r%-16s [%s%s] %3.0f %%\x1b[K", phase_.c_str(), std::string(filled, '#').c_str(),
                   std::string(kWidth - filled, '.').c_str(), 100 * fraction);
    }
    std::fflush(stderr);
  }

 private:
  ProgressMode mode_;
  std::mutex mutex_;
  std::string phase_;
  double fraction_ = 0;
  std::chrono::steady_clock::time_point printed_;
  std::string json_fields_;

  void printJson(double fraction) const {
    std::fprintf(stderr, "{%s\"phase\":\"%s\",\"fraction\":%.4g}\n", json_fields_.c_str(), phase_.c_str(),
                 fraction);
  }
};

}  // namespace

void addProgressFlags(CLI::App* command, ProgressFlags& flags) {
  command->add_option("--progress", flags.mode, "bar (only on a terminal), json or none, on standard error")
      ->check(CLI::IsMember({"bar", "json", "none"}))
      ->capture_default_str();
  command->add_flag("--quiet", flags.quiet, "no progress and no summary");
  command
      ->add_option("--log", flags.log,
                   "what to say on standard error: error, warning or info (each step's time)")
      ->check(CLI::IsMember({"error", "warning", "info"}))
      ->capture_default_str();
}

Log ProgressFlags::logOf(const std::string& command) const {
  return Log(command, log == "error"  ? LogLevel::kError
                      : log == "info" ? LogLevel::kInfo
                                      : LogLevel::kWarning);
}

Progress makeProgress(ProgressMode mode, const std::string& json_fields) {
  if (mode == ProgressMode::kNone || (mode == ProgressMode::kBar && !::isatty(STDERR_FILENO)))
    return [](std::string_view, double) { throwIfInterrupted(); };
  return [printer = std::make_shared<Printer>(mode, json_fields)](std::string_view phase, double fraction) {
    throwIfInterrupted();
    printer->step(phase, fraction);
  };
}

Progress makeProgress(const ProgressFlags& flags, const std::string& json_fields) {
  if (flags.quiet || flags.mode == "none") return makeProgress(ProgressMode::kNone);
  return makeProgress(flags.mode == "json" ? ProgressMode::kJson : ProgressMode::kBar, json_fields);
}

}  // namespace vdb_diffuse
