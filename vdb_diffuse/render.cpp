#include "commands.h"

namespace vdb_diffuse {

void addRender(CLI::App& program, ExitStatus&) { program.add_subcommand("render", "not written yet"); }

}  // namespace vdb_diffuse
