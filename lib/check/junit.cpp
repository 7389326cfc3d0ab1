#include "check/junit.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "plot/markup.h"

namespace vdb_diffuse {
namespace {

using Verdict = JUnitCase::Verdict;

/// Valid UTF-8: a JSON text with whatever is none replaced, and back.
std::string validUtf8(const std::string& text) {
  using nlohmann::json;
  return json::parse(json(text).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
}

std::string attribute(const std::string& name, const std::string& value) {
  return " " + name + "=\"" + escapedMarkup(validUtf8(value)) + "\"";
}

std::string secondsOf(double seconds) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3f", seconds);
  return text;
}

std::string countOf(const std::vector<JUnitCase>& cases, Verdict verdict) {
  return std::to_string(
      std::count_if(cases.begin(), cases.end(), [&](const JUnitCase& c) { return c.verdict == verdict; }));
}

}  // namespace

std::string junitXml(const std::string& suite, const std::vector<JUnitCase>& cases) {
  double total = 0;
  for (const JUnitCase& c : cases) total += c.seconds;
  const std::string counts = attribute("tests", std::to_string(cases.size())) +
                             attribute("failures", countOf(cases, Verdict::kFailed)) +
                             attribute("errors", countOf(cases, Verdict::kNotRun)) +
                             attribute("time", secondsOf(total));
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites" + counts + ">\n  <testsuite" +
                    attribute("name", suite) + counts + attribute("skipped", "0") + ">\n";
  for (const JUnitCase& c : cases) {
    xml += "    <testcase" + attribute("name", c.name) + attribute("classname", suite) +
           attribute("time", secondsOf(c.seconds)) + ">\n";
    if (c.verdict == Verdict::kFailed) xml += "      <failure" + attribute("message", c.message) + "/>\n";
    if (c.verdict == Verdict::kNotRun) xml += "      <error" + attribute("message", c.message) + "/>\n";
    if (!c.output.empty())
      xml += "      <system-out>" + escapedMarkup(validUtf8(c.output)) + "</system-out>\n";
    xml += "    </testcase>\n";
  }
  return xml + "  </testsuite>\n</testsuites>\n";
}

}  // namespace vdb_diffuse
