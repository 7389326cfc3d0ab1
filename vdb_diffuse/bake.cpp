#include "commands.h"

namespace vdb_diffuse {

void addBake(CLI::App& program, ExitStatus&) { program.add_subcommand("bake", "not written yet"); }

}  // namespace vdb_diffuse
