#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

namespace vdb_diffuse::speed {

/// Time on the wall and time of the processor, in seconds. On one thread the second is the smaller one where
/// the machine has other work too.
struct Seconds {
  double wall = 0, cpu = 0;
};

class Stopwatch {
 public:
  Seconds read() const { return {wall() - start_.wall, cpu() - start_.cpu}; }

 private:
  static double wall() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }
  static double cpu() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  Seconds start_{wall(), cpu()};
};

/// Of at least one value.
inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

}  // namespace vdb_diffuse::speed
