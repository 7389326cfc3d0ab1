#pragma once

#include "scene/scene.h"

namespace vdb_diffuse {

/// Leaves out each triangle of the surfaces that has the corners of an earlier one, at the same places and in
/// the same turn, be it of another surface: it would hide the same light in the same place again, and a pile
/// of such triangles is what a ray is slowest at, since no tree of boxes can part them. The same within each
/// area light, which would shine from there again. Two triangles that face opposite ways are no repetition.
/// What stays keeps its order; surfaces without a triangle left are left out.
void dropRepeatedTriangles(Scene& scene);

}  // namespace vdb_diffuse
