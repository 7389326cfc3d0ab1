#pragma once

#include <string>

namespace vdb_diffuse {

enum class LogLevel { kError, kWarning, kInfo };

/// What a command says on standard error beside its progress: lines that begin with "vdb_diffuse COMMAND: ".
class Log {
 public:
  explicit Log(std::string command = "", LogLevel level = LogLevel::kWarning)
      : command_(std::move(command)), level_(level) {}

  void error(const std::string& what) const;
  void warning(const std::string& what) const;
  void info(const std::string& what) const;

 private:
  std::string command_;
  LogLevel level_;

  void line(LogLevel level, const std::string& what) const;
};

}  // namespace vdb_diffuse
