#include "check/junit.h"

#include <gtest/gtest.h>

namespace vdb_diffuse {
namespace {

using Verdict = JUnitCase::Verdict;

TEST(JUnit, CountsAndVerdicts) {
  const std::string xml = junitXml("suite", {{"a", 0.25, Verdict::kPassed, "", "all well"},
                                             {"b", 1.5, Verdict::kFailed, "too far", ""},
                                             {"c", 0, Verdict::kNotRun, "no file", ""}});
  for (const std::string part :
       {R"(<testsuite name="suite" tests="3" failures="1" errors="1" time="1.750")",
        R"(<testcase name="a" classname="suite" time="0.250">)", R"(<failure message="too far"/>)",
        R"(<error message="no file"/>)", "<system-out>all well</system-out>"})
    EXPECT_NE(xml.find(part), std::string::npos) << part << " in " << xml;
}

TEST(JUnit, HoldsNothingThatXmlCannot) {
  const std::string xml = junitXml("s", {{"a<b>&\"c\"", 0, Verdict::kFailed, "\x01\xff ok", ""}});
  EXPECT_NE(xml.find("name=\"a&lt;b&gt;&amp;&quot;c&quot;\""), std::string::npos) << xml;
  for (const char c : xml) EXPECT_TRUE(static_cast<unsigned char>(c) >= ' ' || c == '\n');
  EXPECT_EQ(xml.find('\xff'), std::string::npos);
}

}  // namespace
}  // namespace vdb_diffuse
