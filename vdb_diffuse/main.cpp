#include "commands.h"

int main(int argc, char** argv) {
  using namespace vdb_diffuse;
  CLI::App program("Precomputes the light inside sparse OpenVDB volumes.");
  ExitStatus status = ExitStatus::kDone;
  addBake(program, status);
  addCompare(program, status);
  addInfo(program, status);
  addMake(program, status);
  addRender(program, status);
  CLI11_PARSE(program, argc, argv);
  return static_cast<int>(status);
}
