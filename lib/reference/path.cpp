#include "reference/path.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/luminance.h"

namespace vdb_diffuse {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Optical depth at which a ray is not followed any further: exp(-87) is the least that a float holds.
constexpr double kEnd = 87;
/// Paths play Russian roulette below this part of the power that they had at first, and those that win have
/// all of it again: about what absorbing them one by one would do.
constexpr float kRoulette = 0.25f;

/// (1 - exp(-x)) / x, x >= 0: the mean transmittance within an optical depth x.
inline float meanTransmittance(float x) {
  if (x < 0.1f) return 1 - x * (0.5f - x * (1 / 6.f - x * (1 / 24.f - x / 120.f)));
  return (1 - std::exp(-x)) / x;
}

template <int C>
struct Power {
  float c[C];

  float largest() const { return C == 1 ? c[0] : std::max({c[0], c[C / 2], c[C - 1]}); }
  double bright() const {
    if (C == 1) return c[0];
    return luminance(Vec3d(c[0], c[C / 2], c[C - 1]));
  }
  void scale(float f) {
    for (float& x : c) x *= f;
  }
};

/// kColoured: the channels differ in extinction, so that a free flight drawn for one of them is weighed for
/// the others. With channel j drawn with probability q_j, the density of a collision after a column X (of
/// density times length) is rho sum_j q_j sigma_j exp(-sigma_j X), that of getting as far sum_j q_j
/// exp(-sigma_j X), and each channel's own over that is its weight: the balance heuristic of Veach (1997),
/// and no weight exceeds 1 / q.
template <int C, bool kColoured>
class Follower : public PathFollower {
 public:
  Follower(const Scenery& scenery, const VoxelWalk& walk, BatchTally& tally)
      : scenery_(scenery),
        walk_(walk),
        transform_(scenery.medium.transform()),
        optics_(scenery.medium.optics),
        h_(transform_.meanVoxelSize()),
        tally_(tally),
        diffuse_(tally.diffuse.data()),
        direct_(tally.direct.data()),
        flux_(tally.flux.empty() ? nullptr : tally.flux.data()) {
    for (int c = 0; c < C; ++c) {
      sigma_s_[c] = optics_.sigma_s[c] * h_;
      sigma_t_[c] = optics_.sigmaT()[c] * h_;
      albedo_[c] = static_cast<float>(sigma_t_[c] > 0 ? sigma_s_[c] / sigma_t_[c] : 0);
      thinnest_ = std::min(thinnest_, sigma_t_[c]);
    }
    for (int a = 0; a < 3; ++a) {
      axis_[a] = transform_.axis(a) / transform_.axis(a).length();
      per_h_[a] = h_ / transform_.axis(a).length();
    }
  }

  void follow(const PathStart& start, const Vec3d& power, double u, RandomStream& random) override {
    Power<C> w;
    for (int c = 0; c < C; ++c) w.c[c] = static_cast<float>(power[c]);
    if (start.kind == PathStart::Kind::kRay) {
      followRay(start.origin, start.direction, w, u, random);
    } else if (start.kind == PathStart::Kind::kSurface) {
      Vec3d origin, direction;
      const float reference = w.largest();
      if (reflect(start.point, w, reference, random, origin, direction))
        followRay(origin, direction, w, u, random);
    } else if (start.kind == PathStart::Kind::kMedium) {
      tally_.energy.emitted += w.bright();
      scattered(placeInVoxel(start.voxel, random), isotropicDirection(random), w, random);
    }
  }

 private:
  const Scenery& scenery_;
  const VoxelWalk& walk_;
  const Transform& transform_;
  const Optics& optics_;
  double h_;
  BatchTally& tally_;
  float *diffuse_, *direct_, *flux_;
  double sigma_s_[C], sigma_t_[C], thinnest_ = kInfinity;  // per density and h
  float albedo_[C];
  Vec3d axis_[3];    // the grid's, unit length, in the world
  double per_h_[3];  // voxels

  struct Stretch {  // of a ray in one voxel
    size_t voxel;
    float rho;
    double enter;   // at this length, in h
    double before;  // column up to there
  };
  std::vector<Stretch> stretches_;

  Vec3d cellOf(const Vec3d& p_world) const { return transform_.toIndex(p_world) + Vec3d(0.5); }
  Vec3d worldOf(const Place& place) const {
    return transform_.toWorld(walk_.corner(place.block) + Vec3d(place.x) - Vec3d(0.5));
  }
  Vec3d directionToWorld(const Vec3f& s) const { return axis_[0] * s[0] + axis_[1] * s[1] + axis_[2] * s[2]; }
  Vec3f directionToGrid(const Vec3d& d) const {
    return Vec3f(static_cast<float>(d.dot(axis_[0])), static_cast<float>(d.dot(axis_[1])),
                 static_cast<float>(d.dot(axis_[2])));
  }
  /// Voxels per h along a unit direction of the grid's frame; never zero, so that no division fails.
  Vec3f step(const Vec3f& s) const {
    Vec3f d;
    for (int a = 0; a < 3; ++a) {
      d[a] = s[a] * static_cast<float>(per_h_[a]);
      if (std::abs(d[a]) < 1e-15f) d[a] = std::copysign(1e-15f, d[a]);
    }
    return d;
  }
  Place placeInVoxel(size_t voxel, RandomStream& random) const {
    Place place;
    place.block = static_cast<int32_t>(voxel / kBlockVoxels);
    const Coord local = voxelLocal(static_cast<int>(voxel % kBlockVoxels));
    for (int a = 0; a < 3; ++a) {
      place.voxel[a] = local[a];
      place.x[a] = static_cast<float>(local[a] + random.uniform());
    }
    return place;
  }

  /// Light after a surface: false where it ends there. `reference` is the power that roulette restores.
  bool reflect(const Scenery::SurfacePoint& point, Power<C>& w, float reference, RandomStream& random,
               Vec3d& origin, Vec3d& direction) const {
    const double factor = scenery_.reflect(point, random, direction);
    const Vec3d& albedo = scenery_.scene.surfaces[point.surface].albedo;
    for (int c = 0; c < C; ++c) w.c[c] *= static_cast<float>(factor * albedo[c]);
    origin = point.position + point.normal * scenery_.off_surface;
    return roulette(w, reference, random);
  }

  bool roulette(Power<C>& w, float reference, RandomStream& random) const {
    const float largest = w.largest();
    if (largest >= kRoulette * reference) return true;
    const float survives = largest / reference;
    if (!(random.uniform() < survives)) {
      w.scale(0);
      return false;
    }
    w.scale(1 / survives);
    return true;
  }

  /// Light that has not collided: what it does to every voxel on its way is known, and part of it collides
  /// somewhere there. What is left meets a surface, or escapes.
  void followRay(Vec3d origin, Vec3d direction, Power<C> w, double u, RandomStream& random) {
    const float reference = w.largest();
    while (true) {
      std::optional<Occluder::Hit> hit;
      if (scenery_.surfaces) hit = scenery_.occluder.closest(origin, direction, kInfinity);
      const double column = cross(origin, direction, hit ? hit->distance / h_ : kInfinity, w);
      if (column > 0) {
        collide(origin, direction, column, w, u, random);
        for (int c = 0; c < C; ++c) w.c[c] *= static_cast<float>(std::exp(-sigma_t_[c] * column));
      }
      if (!hit || !(w.largest() > 0)) return;
      const Scenery::SurfacePoint point = scenery_.pointOf(*hit, origin, direction);
      if (!reflect(point, w, reference, random, origin, direction)) return;
      u = random.uniform();
    }
  }

  /// Tallies a ray's light in the voxels it crosses and notes them. Returns the column of density.
  double cross(const Vec3d& origin, const Vec3d& direction, double limit, const Power<C>& w) {
    stretches_.clear();
    const Vec3f s = directionToGrid(direction), d = step(s);
    Place place;
    double start = 0, column = 0;
    if (!walk_.enter(cellOf(origin), Vec3d(d), limit, start, place)) return 0;
    float transmittance[C], travelled = 0;
    for (float& t : transmittance) t = 1;
    double at = start;
    walk_.walk(place, d, static_cast<float>(limit - start), travelled,
               [&](size_t i, float rho, float& length) {
                 stretches_.push_back({i, rho, at, column});
                 const float inside = rho * length;
                 for (int c = 0; c < C; ++c) {
                   const float x = static_cast<float>(sigma_t_[c]) * inside;
                   const float mean = meanTransmittance(x);
                   direct_[i * C + c] += w.c[c] * transmittance[c] * mean * length;
                   transmittance[c] = std::max(0.0f, transmittance[c] * (1 - x * mean));
                 }
                 column += inside;
                 at += length;
                 return column * thinnest_ < kEnd;
               });
    return column;
  }

  /// The first collision of a ray that has crossed `column`, forced: it carries the power that collided.
  void collide(const Vec3d& origin, const Vec3d& direction, double column, Power<C> w, double u,
               RandomStream& random) {
    double chance[C], sum = 0;  // of drawing by a channel: by what it lets collide and scatter
    for (int c = 0; c < C; ++c) {
      const double collided = -std::expm1(-sigma_t_[c] * column);
      chance[c] = collided * w.c[c] * albedo_[c];
      sum += chance[c];
    }
    if (!(sum > 0)) return;
    int drawn = 0;
    double below = 0;
    if (kColoured) {
      const double at = random.uniform() * sum;
      while (drawn < C - 1 && at >= below + chance[drawn]) below += chance[drawn++];
      while (chance[drawn] == 0) --drawn;
    }
    const double collided = -std::expm1(-sigma_t_[drawn] * column);
    const double x = std::min(column, -std::log1p(-u * collided) / sigma_t_[drawn]);
    if (kColoured) {
      double density = 0;
      for (int c = 0; c < C; ++c)
        if (chance[c] > 0)
          density +=
              chance[c] / sum * sigma_t_[c] * std::exp(-sigma_t_[c] * x) / -std::expm1(-sigma_t_[c] * column);
      if (!(density > 0)) return;
      for (int c = 0; c < C; ++c)
        w.c[c] *= static_cast<float>(sigma_s_[c] * std::exp(-sigma_t_[c] * x) / density);
    } else {
      for (int c = 0; c < C; ++c) w.c[c] *= static_cast<float>(collided * albedo_[c]);
    }
    tally_.energy.scattered_in += w.bright();

    auto stretch = std::upper_bound(stretches_.begin(), stretches_.end(), x,
                                    [](double value, const Stretch& s) { return value < s.before; });
    --stretch;  // the first begins at 0
    while (stretch->rho == 0 && stretch != stretches_.begin()) --stretch;
    const Vec3f s = directionToGrid(direction), d = step(s);
    const double t = stretch->enter + (stretch->rho > 0 ? (x - stretch->before) / stretch->rho : 0.0);
    const Vec3d at = cellOf(origin) + Vec3d(d) * t;
    Place place;
    place.block = static_cast<int32_t>(stretch->voxel / kBlockVoxels);
    const Coord local = voxelLocal(static_cast<int>(stretch->voxel % kBlockVoxels));
    for (int a = 0; a < 3; ++a) {
      place.voxel[a] = local[a];
      place.x[a] = static_cast<float>(
          std::clamp(at[a] - walk_.corner(place.block)[a], local[a] + 0.0, local[a] + 1.0));
    }
    scattered(place, deflect(s, random), w, random);
  }

  Vec3f deflect(const Vec3f& s, RandomStream& random) const {
    ++tally_.scatterings;
    return optics_.g == 0 ? isotropicDirection(random) : deflected(s, optics_.g, random);
  }

  /// Light that has scattered, on its way from a place in the medium until it is absorbed or escapes.
  void scattered(Place place, Vec3f s, Power<C> w, RandomStream& random) {
    const float reference = w.largest();
    ReferenceEnergy& energy = tally_.energy;
    uint64_t collisions = 0;
    bool inside = true;  // of a block; else at `origin`, in the world
    Vec3d origin, direction;
    while (true) {
      std::optional<Occluder::Hit> hit;
      if (scenery_.surfaces) {
        if (inside) {
          origin = worldOf(place);
          direction = directionToWorld(s);
        }
        if (!inside || scenery_.surfaces_inside)
          hit = scenery_.occluder.closest(origin, direction, kInfinity);
      }
      const double limit = hit ? hit->distance / h_ : kInfinity;
      const Vec3f d = step(s);
      double start = 0;
      bool collided = false;
      const Power<C> before = w;
      if (inside || walk_.enter(cellOf(origin), Vec3d(d), limit, start, place))
        collided = fly(place, s, d, static_cast<float>(limit - start), w, random);
      if (collided) {
        inside = true;
        const bool goes_on = roulette(w, reference, random);
        energy.absorbed += before.bright() - w.bright();
        if (!goes_on) return;
        if (++collisions >= kMostScatterings) {
          energy.lost += w.bright();
          ++tally_.given_up;
          return;
        }
        s = deflect(s, random);
        continue;
      }
      energy.absorbed += before.bright() - w.bright();  // zero unless extinction is coloured
      energy.escaped += w.bright();
      if (!scenery_.surfaces) return;
      if (inside && !scenery_.surfaces_inside) hit = scenery_.occluder.closest(origin, direction, kInfinity);
      if (!hit) return;
      const Scenery::SurfacePoint point = scenery_.pointOf(*hit, origin, direction);
      if (!reflect(point, w, reference, random, origin, direction)) return;
      energy.escaped -= w.bright();
      s = directionToGrid(direction);
      inside = false;
    }
  }

  /// A free flight: true where it ends in a collision, with the power that scatters; else the power that got
  /// through.
  bool fly(Place& place, const Vec3f& s, const Vec3f& d, float limit, Power<C>& w, RandomStream& random) {
    int drawn = 0;
    float chance[C], sum = 0;
    if (kColoured) {
      for (int c = 0; c < C; ++c) sum += w.c[c];
      for (int c = 0; c < C; ++c) chance[c] = w.c[c] / sum;
      float at = static_cast<float>(random.uniform());
      while (drawn < C - 1 && at >= chance[drawn]) at -= chance[drawn++];
    }
    float left = random.exponential() / static_cast<float>(sigma_t_[drawn]), travelled = 0;
    double column = 0;  // coloured only
    const float bright = flux_ ? static_cast<float>(w.bright()) : 0;
    const VoxelWalk::End end =
        walk_.walk(place, d, limit, travelled, [&](size_t i, float rho, float& length) {
          const float inside = rho * length;
          const bool goes_on = inside < left;
          if (kColoured) {  // all of the voxel is tallied, given that the path came so far
            double reached[C];
            const double all = reach(chance, column, reached);
            double lum[3] = {};
            for (int c = 0; c < C; ++c) {
              const float deposit =
                  static_cast<float>(w.c[c] * reached[c] / all *
                                     meanTransmittance(static_cast<float>(sigma_t_[c] * inside)) * length);
              diffuse_[i * C + c] += deposit;
              lum[c] = deposit;
            }
            if (flux_) addFlux(i, s, static_cast<float>(luminance(Vec3d(lum))));
            column += goes_on ? inside : left;
          }
          if (!goes_on) length = std::min(length, left / rho);
          if (!kColoured) {
            for (int c = 0; c < C; ++c) diffuse_[i * C + c] += w.c[c] * length;
            if (flux_) addFlux(i, s, bright * length);
          }
          left -= inside;
          return goes_on;
        });
    const bool collided = end == VoxelWalk::End::kStopped;
    if (kColoured) {
      double reached[C];
      const double all = reach(chance, column, reached);
      double density = 0;
      for (int c = 0; c < C; ++c) density += chance[c] * sigma_t_[c] * reached[c];
      for (int c = 0; c < C; ++c)
        w.c[c] *= static_cast<float>(collided ? sigma_s_[c] * reached[c] / density : reached[c] / all);
    } else if (collided) {
      for (int c = 0; c < C; ++c) w.c[c] *= albedo_[c];
    }
    return collided;
  }

  /// exp(-sigma_c column) up to a common factor, and their mean by the chances.
  double reach(const float* chance, double column, double* reached) const {
    double all = 0;
    for (int c = 0; c < C; ++c) {
      reached[c] = std::exp(-(sigma_t_[c] - thinnest_) * column);
      all += chance[c] * reached[c];
    }
    return all;
  }

  void addFlux(size_t i, const Vec3f& s, float amount) {
    for (int a = 0; a < 3; ++a) flux_[3 * i + a] += s[a] * amount;
  }
};

}  // namespace

std::unique_ptr<PathFollower> makeFollower(const Scenery& scenery, const VoxelWalk& walk, int channels,
                                           BatchTally& tally) {
  if (channels == 1) return std::make_unique<Follower<1, false>>(scenery, walk, tally);
  const Vec3d sigma_t = scenery.medium.optics.sigmaT();
  if (sigma_t[0] == sigma_t[1] && sigma_t[0] == sigma_t[2])
    return std::make_unique<Follower<3, false>>(scenery, walk, tally);
  return std::make_unique<Follower<3, true>>(scenery, walk, tally);
}

}  // namespace vdb_diffuse
