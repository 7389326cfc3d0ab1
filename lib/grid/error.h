#pragma once

#include <stdexcept>
#include <string>

namespace vdb_diffuse {

/// What a process reports when it ends. The values are part of the command line's contract.
enum class ExitStatus {
  kDone = 0,
  kOutsideTolerance = 1,
  kUsage = 2,
  kInputRefused = 3,
  kNotConverged = 4,
  kOutputNotWritten = 5,
  kInterrupted = 130
};

/// Something the user can mend: one line that says what, which file and grid, and what to do.
class Error : public std::runtime_error {
 public:
  Error(ExitStatus status, const std::string& message) : std::runtime_error(message), status_(status) {}
  ExitStatus status() const { return status_; }

 private:
  ExitStatus status_;
};

struct UsageError : Error {
  explicit UsageError(const std::string& message) : Error(ExitStatus::kUsage, message) {}
};
struct InputError : Error {
  explicit InputError(const std::string& message) : Error(ExitStatus::kInputRefused, message) {}
};
struct OutputError : Error {
  explicit OutputError(const std::string& message) : Error(ExitStatus::kOutputNotWritten, message) {}
};
struct Interrupted : Error {
  Interrupted() : Error(ExitStatus::kInterrupted, "interrupted") {}
};

}  // namespace vdb_diffuse
