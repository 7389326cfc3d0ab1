#include "commands.h"

namespace vdb_diffuse {

void addCompare(CLI::App& program, ExitStatus&) { program.add_subcommand("compare", "not written yet"); }

}  // namespace vdb_diffuse
