#pragma once

#include <CLI/CLI.hpp>

#include "grid/error.h"

namespace vdb_diffuse {

/// Each adds its subcommand with its flags to the program. The subcommand's callback does the work, throws
/// `Error` where it cannot, and sets `status` where the outcome is neither success nor an exception.
void addBake(CLI::App& program, ExitStatus& status);
void addCheck(CLI::App& program, ExitStatus& status);
void addCompare(CLI::App& program, ExitStatus& status);
void addCompletion(CLI::App& program, ExitStatus& status);
void addInfo(CLI::App& program, ExitStatus& status);
void addMake(CLI::App& program, ExitStatus& status);
void addMan(CLI::App& program, ExitStatus& status);
void addPaper(CLI::App& program, ExitStatus& status);
void addReference(CLI::App& program, ExitStatus& status);
void addRender(CLI::App& program, ExitStatus& status);
void addReport(CLI::App& program, ExitStatus& status);

}  // namespace vdb_diffuse
