#pragma once

#include <optional>

#include "diffusion/first_scatter.h"
#include "diffusion/light_path.h"
#include "diffusion/reflected_light.h"
#include "medium/angular_basis.h"

namespace vdb_diffuse {

/// What one voxel has gathered: per channel the mean over directions and the vector mean, for the true and
/// for the rescaled attenuation.
struct Gathered {
  double direct[3] = {}, beam[3] = {};
  Vec3d direct_flux[3], beam_flux[3];
  double second[3][kSecondOrder - kFirstOrder] = {};
  Vec3d lean[3], spread[3];  // of the rescaled light, see BeamShape

  Gathered() {
    for (int c = 0; c < 3; ++c) direct_flux[c] = beam_flux[c] = lean[c] = spread[c] = Vec3d(0);
  }
  void operator+=(const Gathered& o) {
    for (int c = 0; c < 3; ++c) {
      direct[c] += o.direct[c];
      beam[c] += o.beam[c];
      direct_flux[c] += o.direct_flux[c];
      beam_flux[c] += o.beam_flux[c];
      for (int k = 0; k < kSecondOrder - kFirstOrder; ++k) second[c][k] += o.second[c][k];
      lean[c] += o.lean[c];
      spread[c] += o.spread[c];
    }
  }
};

/// The way of light to a place, and by channel as rescaled beams meet it.
struct TwofoldPath {
  LightPath direct, beam[3];
};

/// Densities of a voxel: the medium's, and by channel those that rescaled beams meet.
struct TwofoldDensity {
  float rho = 0, beam[3] = {0, 0, 0};
};

/// From so many beams on, as a dome has, they average among themselves and each takes one ray per voxel.
constexpr int kManyBeams = 16;

/// Points of the unit square or cube, spread evenly by the generalised golden ratio of `dimensions`;
/// -1/2..1/2.
double spreadPoint(int n, int axis, int dimensions);

/// Marches from a voxel to the lights, one by one: to lamps at a finite distance, or to all lights as the
/// reference for beams that are swept.
///
/// A thin voxel is looked at from points within. Where light is weakened much on its way through the voxel,
/// points within would miss most of it: there it is followed from where it enters,
///
///     \   \   \        through points on the faces toward the light, each with its chord of the voxel; what
///      +---\---+       is lost on a chord stays in the voxel, so that thick voxels scatter all that they
///      |    \  |       take from the light.
///
class LightMarch {
 public:
  /// All references must outlive the object.
  /// \param channels  1 or 3
  LightMarch(const BeamMedium& medium, int channels, const Occluder& occluder, const LightSamples& lights,
             const ReflectedLight& reflected, const std::vector<Vec3d>& reflected_directions,
             const FirstScatterSettings& settings);

  /// \param all  march to suns and domes as well
  Gathered gather(size_t block, int n, bool all) const;

 private:
  struct Part;

  const BeamMedium& beams_;
  const Medium& medium_;
  const Occluder& occluder_;
  const LightSamples& lights_;
  const ReflectedLight& reflected_;
  const std::vector<Vec3d>& gather_;  ///< light that surfaces reflect is gathered along these
  const int channels_, rays_;
  const std::vector<std::pair<double, double>> face_points_, face_middle_;  ///< along a side, with weights
  const bool shaped_, rescaled_;
  const double ball_radius_;
  double thickest_ = 0;  ///< extinction of the channel that is weakened most

  /// Light at a point, before the medium weakens it.
  struct Arrival {
    Vec3d power, power_beam;  ///< its part of the mean over directions; the latter in the rescaled medium
    Vec3d toward;             ///< unit length, world, to where it comes from
    double distance;
  };

  bool thick(float rho) const;
  /// From a light to a point, or the direction that its light has everywhere; world.
  Vec3d wayOf(const PointSample& lamp, const Vec3d& p_world) const;
  Vec3d wayOf(const BeamSample& beam, const Vec3d& p_world) const;
  Vec3d wayOf(const Vec3d& reflected_direction, const Vec3d& p_world) const;
  std::optional<Arrival> arrivalOf(const PointSample& lamp, const Vec3d& p_world) const;
  std::optional<Arrival> arrivalOf(const BeamSample& beam, const Vec3d& p_world) const;
  std::optional<Arrival> arrivalOf(const Vec3d& reflected_direction, const Vec3d& p_world) const;

  /// \param direct  through(density, rho) of the medium's own
  template <typename Through>
  TwofoldPath twofold(const LightPath& direct, const TwofoldDensity& density, const Through& through) const;
  template <typename Through>
  TwofoldPath twofold(const TwofoldDensity& density, const Through& through) const {
    return twofold(through(medium_.density, density.rho), density, through);
  }
  template <typename Moments>
  void add(const Arrival& light, const TwofoldPath& path, const Moments& moments, Gathered& sum) const;
  void addPart(const Arrival& light, const TwofoldPath& path, const Part& part, Gathered& sum) const;
  void addLamp(const PointSample& lamp, const Vec3d& voxel, const Part& part, Gathered& sum) const;
  void addBeam(const BeamSample& beam, const Coord& voxel, const TwofoldDensity& density,
               Gathered& sum) const;
  /// \param light  what arrivalOf knows
  template <typename Light>
  void addThroughFaces(const Light& light, const std::vector<std::pair<double, double>>& rule,
                       const Coord& voxel, const TwofoldDensity& density, Gathered& sum) const;
  void placeBesideFaces(const Vec3d& direction, const Coord& voxel, const TwofoldDensity& density,
                        Gathered& sum) const;
};

}  // namespace vdb_diffuse
