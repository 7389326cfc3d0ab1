#include "log.h"

#include <iostream>

namespace vdb_diffuse {
namespace {

/// Names from a file may hold anything, and a message is one line of text.
std::string oneLine(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace

void Log::error(const std::string& what) const {
  line(LogLevel::kError, what);
}
void Log::warning(const std::string& what) const {
  line(LogLevel::kWarning, "warning: " + what);
}
void Log::info(const std::string& what) const {
  line(LogLevel::kInfo, what);
}

void Log::line(LogLevel level, const std::string& what) const {
  if (level > level_) return;
  std::cout.flush();
  std::cerr << "vdb_diffuse" + (command_.empty() ? "" : " " + command_) + ": " + oneLine(what) + "\n"
            << std::flush;
}

}  // namespace vdb_diffuse
