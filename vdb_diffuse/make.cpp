#include "commands.h"

namespace vdb_diffuse {

void addMake(CLI::App& program, ExitStatus&) { program.add_subcommand("make", "not written yet"); }

}  // namespace vdb_diffuse
