#pragma once

#include <map>
#include <string>
#include <vector>

namespace vdb_diffuse {

/// A kind of input, sound files of it, and how the program is made to read one.
struct SpecimenKind {
  std::string name;       ///< as the command line of `mutate` has it
  std::string file_name;  ///< under which the program finds it
  bool is_text = false;
  std::vector<std::string> sound;             ///< whole files
  std::map<std::string, std::string> beside;  ///< other files of the same folder that are needed, by name
  std::vector<std::string> bake;  ///< words of a bake; FILE and VOLUME stand for paths in the folder
};

/// vdb, obj, gltf, glb, exr and json. \throws std::invalid_argument for another name
SpecimenKind specimenKind(const std::string& name);

}  // namespace vdb_diffuse
