#include "medium/transmittance.h"

#include "grid/ray_march.h"

namespace vdb_diffuse {

double columnDensity(const Volume& density, const Vec3d& p, const Vec3d& d, double t0, double t1,
                     double enough) {
  double column = 0;
  marchRay(*density.topology, p, d, t0, t1, [&](size_t block, int voxel, double enter, double exit) {
    column += density.values.block(block)[voxel] * (exit - enter);
    return column <= enough;
  });
  return column;
}

}  // namespace vdb_diffuse
