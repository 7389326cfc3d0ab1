#include "reference/path.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference/grid_frame.h"
#include "reference/noted_ray.h"
#include "reference/power.h"

namespace vdb_diffuse {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Optical depth at which a ray is not followed any further: exp(-60) is 1e-26, and floats are still whole.
constexpr double kEnd = 60;
/// Paths play Russian roulette below this part of the power that they had at first, and those that win have
/// all of it again: about what absorbing them one by one would do.
constexpr float kRoulette = 0.25f;
constexpr float kUnit = 1;  // what a ray brings to the medium on the average, the tally's unit of power
constexpr double kMostWalkers = 64;          // from one ray
constexpr uint64_t kBetweenLooks = 1 << 18;  // scatterings of one walker: some ten milliseconds
constexpr size_t kWaiting = 1 << 13;         // walkers that wait before they set out: some MB

/// The channel that a number in [0, 1) draws by chances that add up to 1.
template <int C, typename T>
int drawnBy(const T* chance, T number) {
  int drawn = 0;
  while (drawn < C - 1 && number >= chance[drawn]) number -= chance[drawn++];
  return drawn;
}

/// kColoured: the channels differ in extinction, so that a free flight drawn for one of them is weighed for
/// the others. With channel j drawn with probability q_j, the density of a collision after a column X (of
/// density times length) is rho sum_j q_j sigma_j exp(-sigma_j X), that of getting as far sum_j q_j
/// exp(-sigma_j X), and each channel's own over that is its weight: the balance heuristic of Veach (1997),
/// and no weight exceeds 1 / q.
template <int C, bool kColoured>
class Follower : public PathFollower {
 public:
  Follower(const Scenery& scenery, const VoxelWalk& walk, double walker_power, std::function<bool()> goes_on,
           BatchTally& tally)
      : scenery_(scenery),
        walk_(walk),
        frame_(scenery.medium.transform()),
        optics_(scenery.medium.optics),
        albedo_varies_(!scenery.medium.albedo.empty()),
        h_(frame_.h()),
        walker_power_(walker_power),
        goes_on_(std::move(goes_on)),
        tally_(tally),
        records_(tally.records.data()),
        direct_(tally.direct.data()),
        flux_(tally.flux.empty() ? nullptr : tally.flux.data()) {
    for (int c = 0; c < C; ++c) {
      sigma_s_[c] = optics_.sigma_s[c] * h_;
      sigma_t_[c] = optics_.sigmaT()[c] * h_;
      albedo_[c] = static_cast<float>(sigma_t_[c] > 0 ? sigma_s_[c] / sigma_t_[c] : 0);
      thinnest_ = std::min(thinnest_, sigma_t_[c]);
    }
  }

  void follow(const PathStart& start, const Vec3d& power, RandomStream& random) override {
    Power<C> w;
    for (int c = 0; c < C; ++c) w.c[c] = static_cast<float>(power[c]);
    if (start.kind == PathStart::Kind::kRay) {
      followRay(start.origin, start.direction, w, random);
    } else if (start.kind == PathStart::Kind::kSurface) {
      Vec3d origin, direction;
      if (reflect(start.point, w, kUnit, random, origin, direction)) followRay(origin, direction, w, random);
    } else if (start.kind == PathStart::Kind::kMedium) {
      tally_.energy.emitted += w.bright();
      const Place place = placeInVoxel(start.voxel, random);
      const Vec3f s = isotropicDirection(random);
      send({place, s, w, random});
    }
  }

  /// Walkers set out in the order of their blocks, so that what one needs of the volume is at hand from the
  /// one before.
  void finish() override {
    order_.clear();
    for (size_t n = 0; n < walkers_.size(); ++n)
      order_.push_back(static_cast<uint64_t>(walkers_[n].place.block) << 32 | n);
    std::sort(order_.begin(), order_.end());
    for (const uint64_t n : order_) {
      Walker& walker = walkers_[n & 0xFFFFFFFFu];
      scattered(walker.place, walker.s, walker.w, walker.random);
    }
    walkers_.clear();
  }

 private:
  const Scenery& scenery_;
  const VoxelWalk& walk_;
  const GridFrame frame_;
  const Optics& optics_;
  bool albedo_varies_;
  double h_;
  double walker_power_;
  std::function<bool()> goes_on_;
  BatchTally& tally_;
  float *records_, *direct_, *flux_;
  double sigma_s_[C], sigma_t_[C], thinnest_ = kInfinity;  // per density and h
  float albedo_[C];

  static constexpr int kRecord = 1 + C;
  NotedRay ray_;

  struct Walker {
    Place place;
    Vec3f s;
    Power<C> w;
    RandomStream random;
  };
  std::vector<Walker> walkers_;
  std::vector<uint64_t> order_;

  void send(const Walker& walker) {
    walkers_.push_back(walker);
    if (walkers_.size() >= kWaiting) finish();
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
  void followRay(Vec3d origin, Vec3d direction, Power<C> w, RandomStream& random) {
    while (true) {
      std::optional<Occluder::Hit> hit;
      if (scenery_.surfaces) hit = scenery_.occluder.closest(origin, direction, kInfinity);
      const double column = cross(origin, direction, hit ? hit->distance / h_ : kInfinity, w);
      if (column > 0) {
        collide(origin, direction, column, w, random);
        for (int c = 0; c < C; ++c) w.c[c] *= static_cast<float>(std::exp(-sigma_t_[c] * column));
      }
      if (!hit || !(w.largest() > 0)) return;
      const Scenery::SurfacePoint point = scenery_.pointOf(*hit, origin, direction);
      if (!reflect(point, w, kUnit, random, origin, direction)) return;
    }
  }

  /// Tallies a ray's light in the voxels it crosses and notes them. Returns the column of density.
  double cross(const Vec3d& origin, const Vec3d& direction, double limit, const Power<C>& w) {
    ray_.clear();
    const Vec3f s = frame_.toGrid(direction), d = frame_.step(s);
    Place place;
    double start = 0, column = 0;
    if (!walk_.enter(frame_.cellOf(origin), Vec3d(d), limit, start, place)) return 0;
    float transmittance[C], travelled = 0;
    for (float& t : transmittance) t = 1;
    double at = start;
    float block_at = 0;
    walk_.walk<kRecord>(records_, place, d, static_cast<float>(limit - start), travelled,
                        [&](size_t i, float rho, float& length) {
                          if (travelled != block_at) {  // in another block, perhaps beyond a gap
                            block_at = travelled;
                            at = start + travelled;
                          }
                          ray_.note({static_cast<int32_t>(i / kBlockVoxels), rho, at, column});
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
    tally_.ray_voxels += ray_.size();
    return column;
  }

  /// First collisions of a ray that has crossed `column`, forced: together they carry, on the average, the
  /// power that collided and scattered. Spread along the ray by its own attenuation.
  void collide(const Vec3d& origin, const Vec3d& direction, double column, const Power<C>& w,
               RandomStream& random) {
    double chance[C], collided[C], sum = 0, largest = 0;  // of drawing by a channel: by what it scatters
    for (int c = 0; c < C; ++c) {
      collided[c] = -std::expm1(-sigma_t_[c] * column);
      chance[c] = collided[c] * w.c[c] * albedo_[c];
      sum += chance[c];
      largest = std::max(largest, chance[c]);
    }
    if (!(sum > 0)) return;
    for (double& x : chance) x /= sum;
    const double expected = std::min(largest / walker_power_, kMostWalkers);
    const int walkers = static_cast<int>(expected + random.uniform());
    const double shift = random.uniform();
    for (int n = 0; n < walkers; ++n) {
      int drawn = 0;
      if (kColoured) {
        drawn = drawnBy<C>(chance, random.uniform());
        while (chance[drawn] == 0) --drawn;
      }
      const double x =
          std::min(column, -std::log1p(-(n + shift) / walkers * collided[drawn]) / sigma_t_[drawn]);
      Power<C> walker = w;
      if (kColoured) {
        double density = 0;
        for (int c = 0; c < C; ++c)
          if (chance[c] > 0) density += chance[c] * sigma_t_[c] * std::exp(-sigma_t_[c] * x) / collided[c];
        if (!(density > 0)) continue;
        for (int c = 0; c < C; ++c)
          walker.c[c] *= static_cast<float>(sigma_s_[c] * std::exp(-sigma_t_[c] * x) / density);
      } else {
        for (int c = 0; c < C; ++c) walker.c[c] *= static_cast<float>(collided[c] * albedo_[c]);
      }
      walker.scale(static_cast<float>(1 / expected));
      const Vec3f s = frame_.toGrid(direction);
      const Place place = ray_.placeAt(x, frame_.cellOf(origin), frame_.step(s), walk_);
      takeWhatIsAbsorbedAt(place, walker);
      RandomStream own(random.bits());
      if (albedo_varies_ && !(walker.largest() > 0)) continue;
      tally_.energy.scattered_in += walker.bright();
      const Vec3f deflected_s = deflect(s, own);
      send({place, deflected_s, walker, own});
    }
  }

  /// What a collision leaves is less by the factor of the albedo field there.
  void takeWhatIsAbsorbedAt(const Place& place, Power<C>& w) const {
    if (!albedo_varies_) return;
    const size_t i = static_cast<size_t>(place.block) * kBlockVoxels +
                     voxelOffset(place.voxel[0], place.voxel[1], place.voxel[2]);
    for (int c = 0; c < C; ++c) w.c[c] *= (*scenery_.medium.albedoIn(c))[i];
  }

  Vec3f deflect(const Vec3f& s, RandomStream& random) const {
    ++tally_.scatterings;
    return optics_.g == 0 ? isotropicDirection(random) : deflected(s, optics_.g, random);
  }

  /// Light that has scattered, on its way from a place in the medium until it is absorbed or escapes.
  void scattered(Place place, Vec3f s, Power<C> w, RandomStream& random) {
    ++tally_.walks;
    const float reference = w.largest();
    ReferenceEnergy& energy = tally_.energy;
    uint64_t collisions = 0;
    bool inside = true;  // of a block; else at `origin`, in the world
    Vec3d origin, direction;
    while (true) {
      std::optional<Occluder::Hit> hit;
      if (scenery_.surfaces) {
        if (inside) {
          origin = frame_.worldOf(walk_.corner(place.block) + Vec3d(place.x));
          direction = frame_.toWorld(s);
        }
        if (!inside || scenery_.surfaces_inside)
          hit = scenery_.occluder.closest(origin, direction, kInfinity);
      }
      const double limit = hit ? hit->distance / h_ : kInfinity;
      const Vec3f d = frame_.step(s);
      double start = 0;
      bool collided = false;
      const Power<C> before = w;
      if (inside || walk_.enter(frame_.cellOf(origin), Vec3d(d), limit, start, place))
        collided = fly(place, s, d, static_cast<float>(limit - start), w, random);
      if (collided) {
        inside = true;
        takeWhatIsAbsorbedAt(place, w);
        const bool goes_on = roulette(w, reference, random);
        energy.absorbed += before.bright() - w.bright();
        if (!goes_on) return;
        if (++collisions % kBetweenLooks == 0 && !goes_on_()) return;
        if (collisions >= kMostScatterings) {
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
      s = frame_.toGrid(direction);
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
      drawn = drawnBy<C>(chance, static_cast<float>(random.uniform()));
    }
    float left = random.exponential() / static_cast<float>(sigma_t_[drawn]), travelled = 0;
    double column = 0;  // coloured only
    uint64_t voxels = 0;
    const float bright = flux_ ? static_cast<float>(w.bright()) : 0;
    const VoxelWalk::End end =
        walk_.walk<kRecord>(records_, place, d, limit, travelled, [&](size_t i, float rho, float& length) {
          ++voxels;
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
              records_[i * kRecord + 1 + c] += deposit;
              lum[c] = deposit;
            }
            if (flux_) addFlux(i, s, static_cast<float>(luminance(Vec3d(lum))));
            column += goes_on ? inside : left;
          }
          if (!goes_on) length = std::min(length, left / rho);
          if (!kColoured) {
            for (int c = 0; c < C; ++c) records_[i * kRecord + 1 + c] += w.c[c] * length;
            if (flux_) addFlux(i, s, bright * length);
          }
          left -= inside;
          return goes_on;
        });
    tally_.walk_voxels += voxels;
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
                                           double walker_power, std::function<bool()> goes_on,
                                           BatchTally& tally) {
  if (channels == 1) return std::make_unique<Follower<1, false>>(scenery, walk, walker_power, goes_on, tally);
  const Vec3d sigma_t = scenery.medium.optics.sigmaT();
  if (sigma_t[0] == sigma_t[1] && sigma_t[0] == sigma_t[2])
    return std::make_unique<Follower<3, false>>(scenery, walk, walker_power, goes_on, tally);
  return std::make_unique<Follower<3, true>>(scenery, walk, walker_power, goes_on, tally);
}

}  // namespace vdb_diffuse
