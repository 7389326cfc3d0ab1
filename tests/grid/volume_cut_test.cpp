#include "grid/volume_cut.h"

#include <gtest/gtest.h>

#include "grid/error.h"
#include "volumes.h"

namespace vdb_diffuse {
namespace {

Volume lumpy(const Transform& transform, const Coord& offset = Coord(0), uint64_t seed = 0) {
  return boxMedium(
             Coord(13, 11, 9), transform, [&](Coord p) { return lumpyDensity(p, seed); }, offset)
      .density;
}

/// As is, with 0 where nothing is.
double valueAt(const Volume& volume, const Coord& p) {
  return volume.values.at(*volume.topology, p);
}

// A turn about z by 30 degrees and a stretch, so that world and index axes have nothing in common.
const Transform kTurned(Vec3d(0.866, 0.5, 0) * 0.3, Vec3d(-0.5, 0.866, 0) * 0.2, Vec3d(0, 0, 0.4),
                        Vec3d(1, 2, 3));

TEST(VolumeCut, LeavesWhatIsDenseEnoughAndInTheBox) {
  const Volume before = lumpy(kTurned, Coord(-3, 5, 2));
  VolumeCut how;
  how.least = 0.4;
  how.crop = WorldBox{Vec3d(-2, 2, 4), Vec3d(1.5, 3.4, 6)};
  const Volume after = cut(before, how);
  size_t left = 0;
  forEachVoxel(*before.topology, [&](Coord p, size_t i) {
    const Vec3d world = kTurned.toWorld(p.asVec3d());
    bool stays = before.values[i] >= 0.4f;
    for (int a = 0; a < 3; ++a) stays &= world[a] >= how.crop->low[a] && world[a] <= how.crop->high[a];
    EXPECT_EQ(after.topology->isActive(p), stays) << p;
    EXPECT_EQ(valueAt(after, p), stays ? before.values[i] : 0) << p;
    left += stays;
  });
  EXPECT_EQ(after.topology->activeVoxelCount(), left);
  EXPECT_GT(left, 10u);
  EXPECT_LT(left, before.topology->activeVoxelCount() / 2);
  EXPECT_EQ(cut(before, {}).topology, before.topology) << "nothing is done where nothing goes";
}

TEST(VolumeCut, MayLeaveNothing) {
  VolumeCut how;
  how.least = 100;
  EXPECT_EQ(cut(lumpy(kTurned), how).topology->blockCount(), 0u);
}

// Offsets of whole blocks, of part of one, and of either sign.
TEST(VolumeSum, AddsWhatIsOnTheSameVoxels) {
  for (const Coord& offset : {Coord(8, -16, 0), Coord(3, -2, 7), Coord(0, 0, 0), Coord(-40, 1, 5)}) {
    const Volume a = lumpy(kTurned, Coord(2, 2, 2)), b = lumpy(kTurned, Coord(-1, 4, 0), 9);
    Volume moved = b;  // whose own voxel p is the first one's p + offset
    moved.transform =
        Transform(kTurned.axis(0), kTurned.axis(1), kTurned.axis(2), kTurned.toWorld(offset.asVec3d()));
    const Volume both = sum(a, moved);
    double of_a = 0, of_b = 0, of_both = 0;
    forEachVoxel(*a.topology, [&](Coord p, size_t i) {
      EXPECT_TRUE(both.topology->isActive(p));
      of_a += a.values[i];
    });
    forEachVoxel(*b.topology, [&](Coord p, size_t i) {
      EXPECT_TRUE(both.topology->isActive(p + offset));
      of_b += b.values[i];
    });
    forEachVoxel(*both.topology, [&](Coord p, size_t i) {
      of_both += both.values[i];
      EXPECT_FLOAT_EQ(both.values[i], static_cast<float>(valueAt(a, p) + valueAt(b, p - offset)));
      EXPECT_TRUE(a.topology->isActive(p) || b.topology->isActive(p - offset)) << p;
    });
    EXPECT_NEAR(of_both, of_a + of_b, 1e-4 * of_both) << offset;
  }
}

TEST(VolumeSum, RefusesVoxelsThatDoNotCoincide) {
  const Volume a = lumpy(kTurned), b = lumpy(kTurned);
  const auto withTransform = [&](const Transform& transform) {
    Volume other = b;
    other.transform = transform;
    return other;
  };
  const Vec3d x = kTurned.axis(0), y = kTurned.axis(1), z = kTurned.axis(2), origin = kTurned.origin();
  EXPECT_THROW(sum(a, withTransform(Transform(x, y, z, origin + 0.4 * x))), InputError) << "half a voxel off";
  EXPECT_THROW(sum(a, withTransform(Transform(x, y, 1.01 * z, origin))), InputError) << "larger";
  EXPECT_THROW(sum(a, withTransform(Transform(y, x, z, origin))), InputError) << "turned";
  EXPECT_THROW(sum(a, withTransform(Transform(x, y, z, origin + 1e12 * x))), InputError) << "far away";
  EXPECT_NO_THROW(sum(a, withTransform(Transform(x, y, z, origin + 1e-5 * x))));
}

}  // namespace
}  // namespace vdb_diffuse
