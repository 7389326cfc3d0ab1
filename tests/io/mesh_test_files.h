#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "grid/error.h"
#include "io/triangle_gltf.h"

namespace vdb_diffuse {

/// Writes a file into a folder of this process and test; its path.
inline std::string writeTestFile(const std::string& name, const std::string& bytes) {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::string path = ::testing::TempDir() + test->test_suite_name() + "." + test->name() + "." + name;
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

/// The message of the InputError that `action` throws; empty where it throws none.
template <typename Action>
std::string refusal(const Action& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace vdb_diffuse
