#include "shapes/sizing.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "grid/error.h"
#include "shapes/noise.h"

namespace vdb_diffuse {

Volume fillToSize(const ShapeSize& size, const std::function<double(double)>& volume_of,
                  const std::function<Volume(double)>& make) {
  constexpr double kNearEnough = 0.02;
  constexpr int kTrials = 6;  // only small shapes need more than one: the lattice shows in their count
  const double wanted = static_cast<double>(size.voxels);
  // The volume depends weakly on h, as finer voxels show finer detail: two rounds settle it.
  double h = 0.01 * kShapeWidth;
  for (int round = 0; round < 3; ++round) h = std::cbrt(volume_of(h) / wanted);

  Volume best;
  double best_error = INFINITY;
  for (int trial = 0; trial < kTrials && best_error > kNearEnough; ++trial) {
    Volume volume = make(h);
    const double count = static_cast<double>(volume.topology->activeVoxelCount());
    const double error = std::abs(count - wanted) / wanted;
    if (error < best_error) {
      best_error = error;
      best = std::move(volume);
    }
    h *= std::cbrt(std::max(count, 1.0) / wanted);
  }
  if (size.voxel_size > 0) {
    const double scale = size.voxel_size / best.transform.meanVoxelSize();
    best.transform = Transform::uniform(size.voxel_size, best.transform.origin() * scale);
  }
  return best;
}

double estimateVolume(const WorldBox& box, const std::function<bool(const Vec3d& p_world)>& is_inside) {
  constexpr size_t kCells = 72;  // per axis: about half a per cent for a cloud
  const Vec3d side = box.high - box.low;
  const size_t hits = sumOverBlocks<size_t>(kCells * kCells, [&](size_t column) {
    size_t found = 0;
    for (size_t k = 0; k < kCells; ++k) {
      const size_t cell[3] = {column / kCells, column % kCells, k}, point = column * kCells + k;
      Vec3d p;
      for (size_t a = 0; a < 3; ++a)
        p[a] = box.low[a] + side[a] * (double(cell[a]) + uniformRandom(0, 3 * point + a)) / kCells;
      if (is_inside(p)) ++found;
    }
    return found;
  });
  return side[0] * side[1] * side[2] * double(hits) / double(kCells * kCells * kCells);
}

void requireFeasible(const ShapeSize& size, double leaf_fill) {
  if (size.voxels < 1) throw UsageError("a volume of 0 voxels cannot be made: ask for at least 1");
  if (!(size.voxel_size >= 0) || !std::isfinite(size.voxel_size))
    throw UsageError("voxel size " + std::to_string(size.voxel_size) + " means nothing: it must be above 0");
  // Two copies of the values while filling, or one and a VDB tree while writing; index tables are small
  // beside.
  constexpr double kBytesPerStoredVoxel = 2 * sizeof(float) + 1;
  const double need = double(size.voxels) / leaf_fill * kBytesPerStoredVoxel;
  const double have = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGESIZE));
  if (need < 0.9 * have) return;
  char text[160];
  std::snprintf(text, sizeof text,
                "%zu voxels would take about %.3g GB of memory, and this machine has %.3g GB: ask for fewer",
                size.voxels, need * 1e-9, have * 1e-9);
  throw InputError(text);
}

}  // namespace vdb_diffuse
