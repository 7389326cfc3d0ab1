#include "commands.h"

namespace vdb_diffuse {

void addInfo(CLI::App& program, ExitStatus&) { program.add_subcommand("info", "not written yet"); }

}  // namespace vdb_diffuse
