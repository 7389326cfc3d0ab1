#include "io/free_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace vdb_diffuse {
namespace {

/// The number that follows `key` in a file of "key value" lines, or stands alone where `key` is empty.
bool readNumber(const char* path, const std::string& key, uint64_t& number) {
  std::ifstream in(path);
  std::string word;
  if (!key.empty())
    while (in >> word && word != key) {
    }
  return static_cast<bool>(in >> number);
}

}  // namespace

uint64_t freeMemory() {
  uint64_t free = uint64_t(1) << 62;
  uint64_t kilobytes = 0, limit = 0, used = 0;
  if (readNumber("/proc/meminfo", "MemAvailable:", kilobytes)) free = std::min(free, 1024 * kilobytes);
  if (readNumber("/sys/fs/cgroup/memory.max", "", limit) &&
      readNumber("/sys/fs/cgroup/memory.current", "", used))
    free = std::min(free, limit > used ? limit - used : 0);
  struct rlimit space;
  uint64_t pages = 0;
  if (::getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY &&
      readNumber("/proc/self/statm", "", pages)) {
    used = pages * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
    free = std::min<uint64_t>(free, space.rlim_cur > used ? space.rlim_cur - used : 0);
  }
  return free;
}

}  // namespace vdb_diffuse
