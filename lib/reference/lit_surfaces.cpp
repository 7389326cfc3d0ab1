#include "reference/lit_surfaces.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace vdb_diffuse {
namespace {

constexpr size_t kMostCuts = 4096;        // a wide plane takes some hundred
constexpr double kPieceOfDistance = 0.5;  // a piece is no wider than this part of its distance

double triangleArea(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return 0.5 * (b - a).cross(c - a).length();
}

}  // namespace

double LitSurfaces::worth(const Vec3d& p, int surface) const {
  const Cone cone = coneAround(p, scenery_.box.centre(), scenery_.box.radius());
  const Vec3d& albedo = scenery_.scene.surfaces[surface].albedo;
  const double share = std::min(1.0, cone.solidAngle() / (2 * M_PI));
  return share * (albedo[0] + albedo[1] + albedo[2]) / 3;
}

LitSurfaces::Piece LitSurfaces::piece(const Vec3d& a, const Vec3d& b, const Vec3d& c, int surface) const {
  return {a, b, c, surface, triangleArea(a, b, c) * worth((a + b + c) / 3.0, surface)};
}

bool LitSurfaces::coarse(const Piece& p) const {
  const double width = std::max({(p.b - p.a).length(), (p.c - p.b).length(), (p.a - p.c).length()});
  const double distance = ((p.a + p.b + p.c) / 3.0 - scenery_.box.centre()).length();
  return width > kPieceOfDistance * std::max(distance, scenery_.box.radius());
}

LitSurfaces::LitSurfaces(const Scenery& scenery) : scenery_(scenery) {
  const auto larger = [](const Piece& x, const Piece& y) { return x.mass < y.mass; };
  std::priority_queue<Piece, std::vector<Piece>, decltype(larger)> queue(larger);
  const auto keep = [&](const Piece& p) {
    if (!(p.mass > 0)) return;
    if (coarse(p))
      queue.push(p);
    else
      pieces_.push_back(p);
  };
  for (size_t s = 0; s < scenery.scene.surfaces.size(); ++s) {
    const Surface& surface = scenery.scene.surfaces[s];
    if (surface.albedo.isZero()) continue;
    for (const auto& t : surface.mesh.triangles)
      keep(piece(surface.mesh.positions[t[0]], surface.mesh.positions[t[1]], surface.mesh.positions[t[2]],
                 static_cast<int>(s)));
  }
  for (size_t cuts = 0; !queue.empty() && cuts < kMostCuts; ++cuts) {
    const Piece p = queue.top();
    queue.pop();
    const Vec3d ab = 0.5 * (p.a + p.b), bc = 0.5 * (p.b + p.c), ca = 0.5 * (p.c + p.a);
    keep(piece(p.a, ab, ca, p.surface));
    keep(piece(ab, p.b, bc, p.surface));
    keep(piece(ca, bc, p.c, p.surface));
    keep(piece(bc, ca, ab, p.surface));
  }
  for (; !queue.empty(); queue.pop()) pieces_.push_back(queue.top());
  double sum = 0;
  for (const Piece& p : pieces_) cumulative_.push_back(sum += p.mass);
}

LitSurfaces::Draw LitSurfaces::draw(double u, double v) const {
  const double at = u * cumulative_.back();
  const size_t n = std::min<size_t>(
      std::upper_bound(cumulative_.begin(), cumulative_.end(), at) - cumulative_.begin(), pieces_.size() - 1);
  const Piece& p = pieces_[n];
  const double before = n > 0 ? cumulative_[n - 1] : 0;
  const double root = std::sqrt(std::clamp((at - before) / (cumulative_[n] - before), 0.0, 1.0));
  Draw draw;
  draw.position = p.a + (p.b - p.a) * (root * (1 - v)) + (p.c - p.a) * (root * v);
  draw.normal = (p.b - p.a).cross(p.c - p.a).unit();
  draw.surface = p.surface;
  draw.area = triangleArea(p.a, p.b, p.c) * cumulative_.back() / p.mass;
  return draw;
}

}  // namespace vdb_diffuse
