#include "medium/directions.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace vdb_diffuse {
namespace {

/// A direction with all its images under turns and mirrors of the axes.
struct Orbit {
  std::array<double, 3> s;  ///< sorted
  double weight;            ///< of all its images together
};

// Found by least squares with a Newton step at the end. Each set meets exactly: all polynomials of s up to
// its degree, and the mean of |s.n| for n along an axis. What freedom is left makes the means of mu,
// mu^3, exp(-tau/mu) and mu exp(-tau/mu) over half the sphere small in error for tau from 0.1 to 2, mu = s.n,
// and the mean of |s.n| for n along diagonals.
constexpr Orbit kOrbits96[] = {{{0.04992207057997, 0.21881201277645, 0.97448914305585}, 0.32885626577007},
                               {{0.27120008312688, 0.61039805677635, 0.74422088602486}, 0.67114373422993}};
constexpr Orbit kOrbits168[] = {{{0.45187048064868, 0.45187048064868, 0.76917237173254}, 0.29356118175414},
                                {{0.21636760569285, 0.62490809470084, 0.75011661252375}, 0.19015492303508},
                                {{0.11176280468466, 0.27989045172459, 0.95350427923656}, 0.34743137680511},
                                {{0.02167982305927, 0.57674293770019, 0.81663796696276}, 0.16885251840567}};

template <size_t N>
DirectionSet imagesOf(const Orbit (&orbits)[N]) {
  DirectionSet set;
  for (int octant = 0; octant < 8; ++octant)
    for (const Orbit& orbit : orbits) {
      std::array<double, 3> s = orbit.s;
      const double images = s[0] == s[1] || s[1] == s[2] ? 24 : 48;
      do {
        const openvdb::Vec3d image(octant & 4 ? -s[0] : s[0], octant & 2 ? -s[1] : s[1],
                                   octant & 1 ? -s[2] : s[2]);
        set.s.push_back(image.unit());
        set.weight.push_back(orbit.weight / images);
      } while (std::next_permutation(s.begin(), s.end()));
    }
  return set;
}

}  // namespace

DirectionSet halfRangeSet(int size) {
  assert(size == 96 || size == 168);
  return size == 96 ? imagesOf(kOrbits96) : imagesOf(kOrbits168);
}

DirectionSet offPlanes() {
  // The fourth moments are those of the sphere: with x^2 + y^2 + z^2 = 1, x^4 + y^4 + z^4 = 3/5.
  const double x = 0.25, sum = 1 - x * x, fourths = 0.6 - x * x * x * x;
  const double root = std::sqrt(2 * fourths - sum * sum);
  const Orbit orbit[] = {{{x, std::sqrt(0.5 * (sum - root)), std::sqrt(0.5 * (sum + root))}, 1}};
  return imagesOf(orbit);
}

DirectionSet offPlanesInRings() {
  const DirectionSet all = offPlanes();
  DirectionSet half;
  for (size_t n = 0; n < all.size(); ++n) {
    const openvdb::Vec3d s = openvdb::math::Abs(all.s[n]);
    if ((s[0] < s[1]) + (s[1] < s[2]) + (s[2] < s[0]) != 2) continue;
    half.s.push_back(all.s[n]);
    half.weight.push_back(2 * all.weight[n]);
  }
  return half;
}

}  // namespace vdb_diffuse
