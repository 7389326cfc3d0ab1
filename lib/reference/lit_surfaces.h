#pragma once

#include "reference/scenery.h"

namespace vdb_diffuse {

/// Draws points of the surfaces that can send light into the volume: by area times albedo times the share of
/// their half-space that the ball around the volume fills. Triangles are cut until that share hardly changes
/// over a piece, so that a ground of any extent is drawn from where it matters.
class LitSurfaces {
 public:
  explicit LitSurfaces(const Scenery& scenery);

  bool empty() const { return pieces_.empty(); }
  struct Draw {
    Vec3d position, normal;  ///< of the front
    int surface = 0;
    double area = 0;  ///< 1 / the density per area it was drawn with
  };
  Draw draw(double u, double v) const;
  /// Share of light reflected at p that goes toward the volume, times the surface's mean albedo.
  double worth(const Vec3d& p, int surface) const;

 private:
  struct Piece {
    Vec3d a, b, c;
    int surface;
    double mass;
  };
  const Scenery& scenery_;
  std::vector<Piece> pieces_;
  std::vector<double> cumulative_;

  Piece piece(const Vec3d& a, const Vec3d& b, const Vec3d& c, int surface) const;
  bool coarse(const Piece& piece) const;
};

}  // namespace vdb_diffuse
