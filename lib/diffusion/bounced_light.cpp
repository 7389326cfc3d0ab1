#include "diffusion/bounced_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "grid/parallel.h"
#include "scene/light_samples.h"
#include "surfaces/surface_cells.h"

namespace vdb_diffuse {
namespace {

constexpr int kPatchesAcross = 32;       ///< beside the volume's longest side, at least
constexpr int kDirections = 64;          ///< in which a patch looks
constexpr size_t kSeekers = 65536;       ///< rays from the volume that look for patches, about
constexpr size_t kMostSought = 8192;     ///< patches that the volume sees; their cubes grow until it is so
constexpr size_t kMostPatches = 16384;   ///< in all, about: later ones take the light of what lies nearby
constexpr int kMostSteps = 8;            ///< from a patch that the volume sees to one that is kept
constexpr int kMostParts = 4;            ///< of a cell that do not see each other
constexpr int kNearby = 3;               ///< a patch in the same cube, so many times doubled, is near
constexpr double kLeft = 1e-3;           ///< of every patch's light when the bounces end
constexpr int kMostBounces = 500;        ///< in a closed white room they would never end
constexpr double kGone = 1e-12;          ///< light that is not waited for, over that of the brightest patch
constexpr size_t kPatchesAtOnce = 1024;  ///< that look around before the patches they see are numbered
constexpr uint32_t kNoPatch = ~0u;

/// Three channels through the medium as it is, then three through the rescaled one.
using Six = std::array<double, 6>;

struct Patch {
  CellKey key;
  SurfacePoint at;
  int steps;  // from the volume
  bool crowded;
  uint32_t next = kNoPatch;  // another part of the same cell
};

/// A patch that another sees along one of its directions.
struct Link {
  uint32_t patch;
  std::array<float, 6> through;  // transmittance times albedo
};

CellKey parentOf(CellKey key) {
  ++key.level;
  key.i >>= 1;
  key.j >>= 1;
  key.k >>= 1;
  return key;
}

/// A number in 0..1 that a patch's number and a salt make.
double hashed(uint64_t n, uint64_t salt) {
  uint64_t h = (n + 1) * 0x9E3779B97F4A7C15ull + salt;
  h = (h ^ (h >> 30)) * 0xBF58476D1CE4E5B9ull;
  h = (h ^ (h >> 27)) * 0x94D049BB133111EBull;
  return static_cast<double>((h ^ (h >> 31)) >> 11) * 0x1p-53;
}

/// Directions about `normal` that stand for equal parts of cos dw; `turn` and `shift` in 0..1 tell sets
/// apart.
Vec3d cosineDirection(int n, const Vec3d& normal, double turn, double shift) {
  constexpr double kGoldenAngle = 2.39996322972865332;
  const double r2 = (n + shift) / kDirections, angle = kGoldenAngle * n + 2 * M_PI * turn;
  const Vec3d helper = std::abs(normal[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d u = normal.cross(helper).unit(), v = normal.cross(u);
  return (u * std::cos(angle) + v * std::sin(angle)) * std::sqrt(r2) + normal * std::sqrt(1 - r2);
}

}  // namespace

struct BouncedLight::Impl {
  const BeamMedium& beams;
  const Medium& medium;
  const std::vector<Surface>& surfaces;
  const Occluder& occluder;
  CellTree tree;
  const double voxel, largest_side;                        // of a voxel: the mean, and the largest
  std::unordered_map<CellKey, uint32_t, CellHash> number;  // of patches; later also of cubes that hold some
  std::vector<Patch> patches;
  std::vector<size_t> first;  // link of each patch, and the end
  std::vector<Link> links;
  std::vector<Six> E, E_of_lit;  // W/m2
  bool teeming = false;          // more surfaces than patches
  int bounces = 0;

  Impl(const BeamMedium& m, const std::vector<Surface>& s, const Occluder& o)
      : beams(m),
        medium(m.medium()),
        surfaces(s),
        occluder(o),
        tree(medium.topology(), medium.transform(), s, finestLevel(medium.topology())),
        voxel(medium.transform().meanVoxelSize()),
        largest_side(largest(medium.transform().voxelSize())) {}

  static double largest(const Vec3d& v) { return std::max({v[0], v[1], v[2]}); }
  static int finestLevel(const Topology& topology) {
    const Coord width = topology.highest() - topology.lowest() + Coord(1);
    return std::max(
        0, std::ilogb(static_cast<double>(std::max({width[0], width[1], width[2]})) / kPatchesAcross));
  }

  Vec3d normalOf(int surface, uint32_t triangle, bool front) const {
    const Mesh& mesh = surfaces[surface].mesh;
    const auto& t = mesh.triangles[triangle];
    const Vec3d n =
        (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
    const double length = n.length();
    return length > 0 ? n * ((front ? 1 : -1) / length) : Vec3d(0);
  }

  /// A place where a ray met a surface that reflects.
  struct Meeting {
    Occluder::Hit hit;
    CellKey key;
    SurfacePoint at;
  };
  std::optional<Meeting> meet(const Vec3d& origin, const Vec3d& direction) const {
    const auto hit = occluder.closest(origin, direction, std::numeric_limits<double>::infinity());
    if (!hit || surfaces[hit->surface].albedo.isZero()) return std::nullopt;
    const Vec3d p = origin + direction * hit->distance,
                normal = normalOf(hit->surface, hit->triangle, hit->front);
    if (normal.isZero()) return std::nullopt;  // a triangle without area
    return Meeting{*hit,
                   tree.keyOf(hit->surface, hit->triangle, hit->front, medium.transform().toIndex(p)),
                   {p, normal}};
  }

  /// The part of a cell that a point lies in, the last where there is none; from the first part on.
  uint32_t partOf(uint32_t n, const SurfacePoint& at, bool& found) const {
    for (;; n = patches[n].next) {
      found = !patches[n].crowded || seeEachOther(at, patches[n].at, voxel, occluder);
      if (found || patches[n].next == kNoPatch) return n;
    }
  }
  /// The number of the patch met, which is new where nobody has met it before.
  uint32_t numberOf(const Meeting& met, int steps) {
    const auto next = static_cast<uint32_t>(patches.size());
    const auto [at, added] = number.emplace(met.key, next);
    if (!added) {
      bool found;
      const uint32_t part = partOf(at->second, met.at, found);
      if (found) return part;
      int parts = 1;
      for (uint32_t n = at->second; patches[n].next != kNoPatch; n = patches[n].next) ++parts;
      if (parts == kMostParts) return at->second;
      patches[part].next = next;
    }
    const double width = std::ldexp(largest_side, met.key.level);
    patches.push_back(
        {met.key, met.at, steps, crowded(met.at, std::sqrt(3.0) * width, voxel, occluder), kNoPatch});
    return next;
  }
  /// The patch of a cell where a point lies, or one nearby that it sees where nobody has met it; one nearby
  /// that it does not see where there are more surfaces than patches.
  uint32_t nearest(CellKey key, const SurfacePoint& at) const {
    uint32_t unseen = kNoPatch;
    if (const auto first_part = number.find(key); first_part != number.end()) {
      bool found;
      const uint32_t part = partOf(first_part->second, at, found);
      if (found) return part;
      unseen = part;
    }
    for (int n = 0; n < kNearby; ++n) {
      key = parentOf(key);
      const auto part = number.find(key);
      if (part == number.end()) continue;
      if (seeEachOther(at, patches[part->second].at, voxel, occluder)) return part->second;
      if (unseen == kNoPatch) unseen = part->second;
    }
    return teeming ? unseen : kNoPatch;
  }

  /// Looks for surfaces from all parts of the volume.
  void seek() {
    const Topology& topology = medium.topology();
    constexpr size_t kFewest = 4, kMost = 512;
    const size_t blocks = std::min(topology.blockCount(), kSeekers / kFewest);
    const size_t per_block = std::clamp(kSeekers / blocks, kFewest, kMost);
    constexpr int kSet = 1021, kStride = 617;  // primes: successive rays lie far apart
    const std::vector<Vec3d> directions = sphereDirections(kSet);
    std::vector<std::optional<Meeting>> met(blocks * per_block);
    forEachBlock(blocks, [&](size_t n) {
      const size_t b = n * topology.blockCount() / blocks;
      for (size_t k = 0; k < per_block; ++k) {
        auto voxel_of = topology.active(b).findNextOn(static_cast<uint32_t>(k * 197 % kBlockVoxels));
        if (voxel_of >= kBlockVoxels) voxel_of = topology.active(b).findFirstOn();
        const Coord p = topology.origin(b) + voxelLocal(static_cast<int>(voxel_of));
        met[n * per_block + k] =
            meet(medium.transform().toWorld(p.asVec3d()), directions[(n * per_block + k) * kStride % kSet]);
      }
    });
    const auto none = [](const std::optional<Meeting>& m) { return !m; };
    met.erase(std::remove_if(met.begin(), met.end(), none), met.end());
    growCubes(met);
    for (const auto& m : met) numberOf(*m, 0);
  }

  /// Foliage in the volume has more surface than patches could be kept for.
  void growCubes(std::vector<std::optional<Meeting>>& met) {
    for (;;) {
      std::unordered_set<CellKey, CellHash> keys;
      for (const auto& m : met) keys.insert(m->key);
      if (keys.size() <= kMostSought) return;
      tree.widen();
      teeming = true;
      for (auto& m : met)
        m->key =
            tree.keyOf(m->hit.surface, m->hit.triangle, m->hit.front, medium.transform().toIndex(m->at.p));
    }
  }

  struct Seen {
    Meeting met;
    std::array<float, 6> through;
  };

  /// What a patch sees; the lights' own light there adds to E_of_lit.
  void look(size_t n, const Lit& lit, std::vector<Seen>& seen) {
    const Patch& patch = patches[n];
    const Vec3d from = offSurface(patch.at, voxel, occluder);
    const double turn = hashed(n, 1), shift = hashed(n, 2);
    for (int k = 0; k < kDirections; ++k) {
      const Vec3d direction = cosineDirection(k, patch.at.normal, turn, shift);
      const auto met = meet(from, direction);
      if (!met) continue;
      const TwofoldLight through = beams.transmittance(from, direction, met->hit.distance);
      const TwofoldLight light = lit(met->hit, from, direction);
      Seen s{*met, {}};
      for (int c = 0; c < 6; ++c) {
        const double T = c < 3 ? through.direct[c] : through.beam[c - 3];
        E_of_lit[n][c] += M_PI / kDirections * T * (c < 3 ? light.direct[c] : light.beam[c - 3]);
        s.through[c] = static_cast<float>(T * surfaces[met->hit.surface].albedo[c % 3]);
      }
      seen.push_back(s);
    }
  }

  void findLinks(const Lit& lit) {
    std::vector<std::pair<size_t, Meeting>> open;  // links to cells that are no patches
    std::vector<std::vector<Seen>> seen;
    for (size_t begin = 0; begin < patches.size(); begin += seen.size()) {
      const size_t end = std::min(patches.size(), begin + kPatchesAtOnce);
      seen.assign(end - begin, {});
      E_of_lit.resize(end, Six{});
      forEachBlock(seen.size(), [&](size_t n) { look(begin + n, lit, seen[n]); });
      for (size_t n = begin; n < end; ++n) {
        first.push_back(links.size());
        const int steps = patches[n].steps + 1;
        for (const Seen& s : seen[n - begin]) {
          const bool full = patches.size() >= kMostPatches, enough = full || steps > kMostSteps;
          teeming = teeming || full;
          if (enough && number.find(s.met.key) == number.end()) {
            open.emplace_back(links.size(), s.met);
            links.push_back({kNoPatch, s.through});
          } else {
            links.push_back({numberOf(s.met, steps), s.through});
          }
        }
      }
    }
    first.push_back(links.size());
    numberCubes();
    for (const auto& [link, met] : open) links[link].patch = nearest(met.key, met.at);
  }

  /// Gives cubes that hold patches the number of one of them.
  void numberCubes() {
    for (uint32_t n = 0; n < patches.size(); ++n) {
      CellKey key = patches[n].key;
      for (int level = 0; level < kNearby; ++level) {
        key = parentOf(key);
        number.emplace(key, n);
      }
    }
  }

  /// One bounce after the other, until every patch has got all but kLeft of its light.
  void bounce() {
    E = E_of_lit;
    double most_reflected = 0;
    for (const Surface& surface : surfaces)
      for (int c = 0; c < 3; ++c) most_reflected = std::max(most_reflected, surface.albedo[c]);
    std::vector<Six> next(E.size());
    double last_change = 0, last_share = 0;
    while (bounces < kMostBounces) {
      forEachBlock(E.size(), [&](size_t n) {
        Six sum{};
        for (size_t l = first[n]; l < first[n + 1]; ++l) {
          if (links[l].patch == kNoPatch) continue;
          const Six& from = E[links[l].patch];
          for (int c = 0; c < 6; ++c) sum[c] += links[l].through[c] * from[c];
        }
        for (int c = 0; c < 6; ++c) next[n][c] = E_of_lit[n][c] + sum[c] / kDirections;
      });
      Six brightest{};
      for (const Six& e : next)
        for (int c = 0; c < 6; ++c) brightest[c] = std::max(brightest[c], e[c]);
      double change = 0;  // the largest, of a patch's light
      for (size_t n = 0; n < E.size(); ++n)
        for (int c = 0; c < 6; ++c)
          if (next[n][c] > kGone * brightest[c])
            change = std::max(change, (next[n][c] - E[n][c]) / next[n][c]);
      E.swap(next);
      ++bounces;
      // From one bounce to the next light keeps at most the share q: what is left is a geometric series. As
      // bright and dark surfaces take turns, the last two shares count.
      const double share = last_change > 0 ? change / last_change : 1;
      const double q = std::min(most_reflected, std::max(share, last_share));
      last_change = change;
      last_share = share;
      if (change * q <= kLeft * (1 - q)) break;
    }
  }
};

BouncedLight::BouncedLight(const BeamMedium& medium, const std::vector<Surface>& surfaces,
                           const Occluder& occluder, const Lit& lit)
    : impl_(std::make_unique<Impl>(medium, surfaces, occluder)) {
  impl_->seek();
  impl_->findLinks(lit);
  if (!impl_->links.empty()) impl_->bounce();
  impl_->links = {};
}
BouncedLight::~BouncedLight() = default;

int BouncedLight::bounces() const {
  return impl_->bounces;
}

size_t BouncedLight::patches() const {
  return impl_->patches.size();
}

TwofoldLight BouncedLight::irradiance(int surface, uint32_t triangle, bool front,
                                      const SurfacePoint& at) const {
  if (impl_->bounces == 0) return {};
  const CellKey key = impl_->tree.keyOf(surface, triangle, front, impl_->medium.transform().toIndex(at.p));
  const uint32_t n = impl_->nearest(key, at);
  if (n == kNoPatch) return {};
  const Six& e = impl_->E[n];
  return {Vec3d(e[0], e[1], e[2]), Vec3d(e[3], e[4], e[5])};
}

}  // namespace vdb_diffuse
