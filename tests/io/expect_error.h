#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

#include "grid/error.h"

namespace vdb_diffuse {

/// The work throws an Error of this status, in one line that holds all these words.
template <typename Work>
void expectError(ExitStatus status, std::initializer_list<std::string> words, const Work& work) {
  try {
    work();
    ADD_FAILURE() << "nothing was thrown";
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(error.status(), status) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    for (const std::string& word : words)
      EXPECT_NE(what.find(word), std::string::npos) << word << " in: " << what;
  }
}

}  // namespace vdb_diffuse
