#include "reference/sources.h"

#include <algorithm>
#include <cmath>

#include "reference/lamp.h"
#include "reference/lit_surfaces.h"
#include "reference/luminance.h"

namespace vdb_diffuse {
namespace {

/// Paths of a source's trial, and the least share of all paths that a source gets which may have any power:
/// a trial can miss a small bright place.
constexpr int kTrial = 512;
constexpr double kLeastShare = 0.01;

class LampIntoBox : public Source {
 public:
  LampIntoBox(std::shared_ptr<const Lamp> lamp, const Scenery& scenery) : lamp_(lamp), scenery_(scenery) {}

  int dimensions() const override { return lamp_->dimensions(); }
  PathStart start(const double u[4], RandomStream& random) const override {
    const Lamp::Ray ray = lamp_->aimed(u, random);
    PathStart start;
    if (ray.power.isZero() || !scenery_.box.meets(ray.origin, ray.direction)) return start;
    start.kind = PathStart::Kind::kRay;
    start.power = ray.power;
    start.origin = ray.origin;
    start.direction = ray.direction;
    return start;
  }

 private:
  std::shared_ptr<const Lamp> lamp_;
  const Scenery& scenery_;
};

class LampOntoSurfaces : public Source {
 public:
  LampOntoSurfaces(std::shared_ptr<const Lamp> lamp, std::shared_ptr<const LitSurfaces> surfaces,
                   const Scenery& scenery)
      : lamp_(lamp), surfaces_(surfaces), scenery_(scenery) {}

  int dimensions() const override { return 4; }
  PathStart start(const double u[4], RandomStream& random) const override {
    const LitSurfaces::Draw draw = surfaces_->draw(u[0], u[1]);
    const Lamp::Arrival light = lamp_->at(draw.position, u + 2, random);
    PathStart start;
    if (light.irradiance.isZero() || scenery_.box.meets(light.origin, light.direction)) return start;
    const double cosine = -draw.normal.dot(light.direction);
    const Vec3d normal = cosine < 0 ? -draw.normal : draw.normal;
    const Vec3d above = draw.position + normal * scenery_.off_surface;
    if (cosine == 0 || scenery_.occluder.hidden(above, -light.direction, light.distance)) return start;
    start.kind = PathStart::Kind::kSurface;
    start.power = light.irradiance * (std::abs(cosine) * draw.area);
    start.point = {draw.position, normal, draw.surface};
    return start;
  }
  double worth(const PathStart& start) const override {
    if (start.kind == PathStart::Kind::kNothing) return 0;
    return luminance(start.power) * surfaces_->worth(start.point.position, start.point.surface);
  }

 private:
  std::shared_ptr<const Lamp> lamp_;
  std::shared_ptr<const LitSurfaces> surfaces_;
  const Scenery& scenery_;
};

/// Voxels that glow, drawn by their power 4 pi sigma_a rho Q V, Q being the mean of its colours; where
/// sigma_a is not the same everywhere it belongs to Q.
class Glow : public Source {
 public:
  explicit Glow(const Medium& medium) {
    const double volume = medium.transform().voxelVolume();
    const bool varies = !medium.albedo.empty();
    power_ = (varies ? Vec3d(1) : medium.optics.sigma_a) * (4 * M_PI * volume * medium.optics.emission_scale);
    if (medium.emission.empty() || power_.isZero()) return;
    const size_t colours = varies ? 3 : medium.emission.size();
    const auto radiance = [&](size_t c, size_t i) {
      const double Q = medium.emissionIn(static_cast<int>(c))[i];
      return varies ? Q * medium.absorptionIn(static_cast<int>(c), i) : Q;
    };
    const Topology& topology = medium.topology();
    for (size_t b = 0; b < topology.blockCount(); ++b)
      for (auto it = topology.active(b).beginOn(); it; ++it) {
        const size_t i = b * kBlockVoxels + it.pos();
        double Q = 0;
        for (size_t c = 0; c < colours; ++c) Q += radiance(c, i);
        const double glow = static_cast<double>(medium.density.values[i]) * (Q / colours);
        if (!(glow > 0)) continue;
        total_ += glow;
        voxels_.push_back(i);
        if (colours > 1)
          tints_.push_back(Vec3d(radiance(0, i), radiance(1, i), radiance(2, i)) * (colours / Q));
        cumulative_.push_back(total_);
      }
  }
  bool dark() const { return voxels_.empty(); }
  int dimensions() const override { return 2; }

  PathStart start(const double u[4], RandomStream&) const override {
    PathStart start;
    start.kind = PathStart::Kind::kMedium;
    const size_t drawn =
        std::upper_bound(cumulative_.begin(), cumulative_.end(), u[0] * total_) - cumulative_.begin();
    const size_t n = std::min(drawn, voxels_.size() - 1);
    start.power = power_ * total_;
    if (!tints_.empty()) start.power = start.power * tints_[n];
    start.voxel = voxels_[n];
    return start;
  }

 private:
  Vec3d power_;
  double total_ = 0;
  std::vector<size_t> voxels_;
  std::vector<Vec3d> tints_;  ///< of each voxel's Q over its mean; empty: grey
  std::vector<double> cumulative_;
};

}  // namespace

double Source::worth(const PathStart& start) const {
  return start.kind == PathStart::Kind::kNothing ? 0 : luminance(start.power);
}

std::vector<std::unique_ptr<Source>> sourcesOf(const Scenery& scenery) {
  std::vector<std::unique_ptr<Source>> sources;
  const auto surfaces = std::make_shared<const LitSurfaces>(scenery);
  for (const NamedLight& named : scenery.scene.lights) {
    const std::shared_ptr<const Lamp> lamp = lampOf(named.light, scenery);
    if (!lamp) continue;
    sources.push_back(std::make_unique<LampIntoBox>(lamp, scenery));
    if (!surfaces->empty()) sources.push_back(std::make_unique<LampOntoSurfaces>(lamp, surfaces, scenery));
  }
  if (auto glow = std::make_unique<Glow>(scenery.medium); !glow->dark()) sources.push_back(std::move(glow));

  double total = 0;
  for (const auto& source : sources) {
    for (int n = 0; n < kTrial; ++n) {
      RandomStream random(0, 0, n);
      const double u[4] = {random.uniform(), random.uniform(), random.uniform(), random.uniform()};
      source->worth_of_all += source->worth(source->start(u, random)) / kTrial;
    }
    total += source->worth_of_all;
  }
  double sum = 0;
  for (const auto& source : sources) {
    source->share = std::max(total > 0 ? source->worth_of_all / total : 1, kLeastShare);
    sum += source->share;
  }
  for (const auto& source : sources) source->share /= sum;
  return sources;
}

}  // namespace vdb_diffuse
