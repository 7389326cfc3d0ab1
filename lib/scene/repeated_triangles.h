#pragma once

#include "scene/scene.h"

namespace vdb_diffuse {

/// Leaves out each triangle that has the corners of an earlier one, at the same places and in the same turn:
/// it would hide and shine in the same place again, and a pile of such triangles is what a ray is slowest
/// at, since no tree of boxes can part them. Two that face opposite ways are no repetition. Those that stay
/// keep their order.
void dropRepeatedTriangles(Mesh& mesh);

}  // namespace vdb_diffuse
