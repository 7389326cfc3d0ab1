#pragma once

#include <string>

#include "scene/scene.h"

namespace vdb_diffuse {

/// Of one file, of all that a scene names and of all occluders together, every instance counted; 24 to 84
/// bytes each as a mesh.
constexpr size_t kMostTriangles = 50'000'000;

/// Which of the VDB's axes points up.
enum class Up { kY, kZ };

/// All triangles of an OBJ, glTF or GLB file as one mesh: node transforms applied, polygons triangulated.
/// glTF has y up by definition and is turned where the VDB has z up: (x, y, z) becomes (x, -z, y). OBJ says
/// nothing about its axes and stays as it is. Coordinates pass through float on the way.
/// \throws InputError naming the path: missing, not a regular file, too large, damaged, without a triangle,
///         an index out of range, a coordinate that is not finite
Mesh readMesh(const std::string& path, Up up = Up::kZ);

}  // namespace vdb_diffuse
