#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse {

/// What continuous integration shows of one test.
struct JUnitCase {
  enum class Verdict { kPassed, kFailed, kNotRun };
  std::string name;
  double seconds = 0;
  Verdict verdict = Verdict::kPassed;
  std::string message;  ///< one line: why it failed, or was not run
  std::string output;   ///< what else there is to say
};

/// A test suite as JUnit XML, UTF-8: one <testsuite>, a <testcase> for each, with <failure> where it failed
/// and <error> where it was not run. Bytes that XML cannot hold become '?'.
std::string junitXml(const std::string& suite, const std::vector<JUnitCase>& cases);

}  // namespace vdb_diffuse
