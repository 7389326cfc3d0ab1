#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "io/temporary_folder.h"

namespace vdb_diffuse {

struct Outcome {
  int status = -1;  ///< exit status; -1 where a signal ended the program
  std::string out, error;
};

/// Runs vdb_diffuse with the rest of a shell's command line.
inline Outcome runProgram(const std::string& arguments) {
  const TemporaryFolder folder;
  const std::string command = std::string("'") + VDB_DIFFUSE_PROGRAM + "' " + arguments + " > '" +
                              folder.file("out") + "' 2> '" + folder.file("error") + "' < /dev/null";
  const int result = std::system(command.c_str());
  return {WIFEXITED(result) ? WEXITSTATUS(result) : -1, contentsOf(folder.file("out")),
          contentsOf(folder.file("error"))};
}

/// The program ended with this status and said one line with these words on standard error.
inline void expectRefusal(const Outcome& outcome, int status, std::initializer_list<std::string> words) {
  EXPECT_EQ(outcome.status, status) << outcome.error;
  EXPECT_EQ(outcome.error.find('\n'), outcome.error.size() - 1) << outcome.error;
  for (const std::string& word : words)
    EXPECT_NE(outcome.error.find(word), std::string::npos) << word << " in: " << outcome.error;
}

}  // namespace vdb_diffuse
