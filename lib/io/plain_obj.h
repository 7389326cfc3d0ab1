#pragma once

#include <string>

namespace vdb_diffuse {

/// The Wavefront OBJ file at `path` again with nothing in it but vertices and faces, the latter by their
/// vertices alone: materials, groups, normals and curves are of no use here, and each is something that an
/// importer may stumble over. Faults are told with their line.
/// \throws InputError naming the path
std::string plainObj(const std::string& path);

}  // namespace vdb_diffuse
