#pragma once

#include "grid/transform.h"

namespace vdb_diffuse {

/// Rec. 709.
inline double luminance(const Vec3d& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

}  // namespace vdb_diffuse
