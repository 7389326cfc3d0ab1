#pragma once

#include <cstdint>
#include <vector>

namespace vdb_diffuse {

/// A place in the cloud's own coordinates, z up.
struct CloudPoint {
  float x, y, z;
};

/// One ball of the heap that gives a cloud its outline. Lobes stand in depth-first order.
struct Lobe {
  CloudPoint centre;
  float radius;
  float reach;   ///< radius of a ball about the same centre that holds the lobe and all that grow on it
  uint32_t end;  ///< first lobe after those that grow on this one
};

/// A heap of balls on which smaller balls grow, over three sizes, more on the upper side: the billows of a
/// cumulus, with a few small detached heaps beside it. About 10 units wide, its base at z = 0, centred on the
/// z axis. The same seed gives the same heap.
std::vector<Lobe> cumulusLobes(uint64_t seed);

/// Depth below the surface of the heap, positive inside, with soft creases, cut to `least` .. `most`: `least`
/// on the outside, where no lobe is nearer. There it steps by up to the soft creases' height.
float depthInLobes(const std::vector<Lobe>& lobes, CloudPoint p, float least, float most);

/// The lobes that decide the depth somewhere in a ball, in order: `depthInLobes` gives the same with these as
/// with all. Empty where the depth is `least` throughout.
void lobesNear(const std::vector<Lobe>& lobes, CloudPoint centre, float radius, float least,
               std::vector<Lobe>& near);

}  // namespace vdb_diffuse
