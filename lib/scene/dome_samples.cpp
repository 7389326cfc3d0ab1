#include "scene/dome_samples.h"

#include <algorithm>
#include <cmath>

// Where an image's pixels lie, as in Cycles' direction_to_equirectangular. For light from `d`, unit length:
//
//     u = 1/2 - atan2(d.y, d.x) / (2 pi)     0 at the left edge, 1 at the right
//     v = acos(d.z) / pi                     0 at the top edge, 1 at the bottom (Cycles counts v upwards)
//
//     v = 0  +z +--------+--------+
//               |   +y   |   -y   |          the middle column looks along +x,
//     v = 1  -z +--------+--------+          the left and right edges along -x
//             u = 0     1/2       1

namespace vdb_diffuse {
namespace {

constexpr double kPi = 3.14159265358979323846;
/// A cell narrower than this (radians, like the sharpest sun) is one direction: cutting it again buys
/// nothing.
constexpr double kSmallestCell = 0.02;

double luminance(const Vec3d& rgb) {
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}  // BT.709

/// About z by `angle`, counter-clockwise seen from above.
Vec3d rotated(const Vec3d& d, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return Vec3d(c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]);
}

/// A rectangle of an image, in pixels from the top left corner, that may cut through pixels.
struct Cell {
  double x0, x1, y0, y1;
  Vec3d rgb{0, 0, 0};             // integral of the radiance over the cell's solid angle
  Vec3d direction{0, 0, 0};       // integral of luminance times the direction the light comes from
  double width = 0, height = 0;   // radians, on the sphere
  double half_x = 0, half_y = 0;  // where to cut it into halves of equal energy
  double priority() const {
    const double extent = std::max(width, height);
    return extent <= kSmallestCell ? 0 : luminance(rgb) * extent * extent;
  }
};

/// The boundary between two pixels that comes nearest to halving the energy; within one pixel, the middle.
double halvingBoundary(const std::vector<double>& energy, double begin, double end, double middle) {
  if (energy.size() < 2) return middle;
  double total = 0, sum = 0, best = 0, best_error = HUGE_VAL;
  for (double e : energy) total += e;
  for (size_t i = 0; i + 1 < energy.size(); ++i) {
    sum += energy[i];
    if (const double error = std::abs(sum - 0.5 * total); error < best_error) {
      best_error = error;
      best = std::floor(begin) + 1.0 + static_cast<double>(i);
    }
  }
  return std::clamp(best, begin, end);
}

/// Fills in what the cell's pixels say. The integrals are exact for radiance constant in each pixel.
Cell measured(const Image& image, Cell cell) {
  const int first_x = static_cast<int>(cell.x0), last_x = static_cast<int>(std::ceil(cell.x1));
  const int first_y = static_cast<int>(cell.y0), last_y = static_cast<int>(std::ceil(cell.y1));
  const auto theta = [&](double y) { return kPi * y / image.height; };
  const auto phi = [&](double x) { return kPi - 2 * kPi * x / image.width; };

  struct Column {
    double width, cos_phi, sin_phi;  // integrals over phi of 1, cos(phi), sin(phi)
  };
  std::vector<Column> columns;
  for (int x = first_x; x < last_x; ++x) {
    const double a = phi(std::min(x + 1.0, cell.x1)), b = phi(std::max<double>(x, cell.x0));
    columns.push_back({b - a, std::sin(b) - std::sin(a), std::cos(a) - std::cos(b)});
  }
  std::vector<double> energy_x(columns.size()), energy_y;
  for (int y = first_y; y < last_y; ++y) {
    const double a = theta(std::max<double>(y, cell.y0)), b = theta(std::min(y + 1.0, cell.y1));
    const double solid = std::cos(a) - std::cos(b);                           // int sin
    const double across = 0.5 * (b - a - std::sin(b - a) * std::cos(a + b));  // int sin^2
    const double along = 0.5 * std::sin(b - a) * std::sin(a + b);             // int sin cos
    const Vec3f* row = image.pixels.data() + static_cast<size_t>(y) * image.width + first_x;
    double row_energy = 0;
    Vec3d row_rgb(0);
    for (size_t i = 0; i < columns.size(); ++i) {
      const Vec3d radiance(row[i]);
      const double bright = luminance(radiance), energy = bright * columns[i].width * solid;
      row_rgb += radiance * columns[i].width;
      row_energy += energy;
      energy_x[i] += energy;
      cell.direction +=
          bright * Vec3d(across * columns[i].cos_phi, across * columns[i].sin_phi, along * columns[i].width);
    }
    cell.rgb += row_rgb * solid;
    energy_y.push_back(row_energy);
  }
  const double equal_area = std::acos(0.5 * (std::cos(theta(cell.y0)) + std::cos(theta(cell.y1))));
  cell.half_x = halvingBoundary(energy_x, cell.x0, cell.x1, 0.5 * (cell.x0 + cell.x1));
  cell.half_y = halvingBoundary(energy_y, cell.y0, cell.y1, equal_area * image.height / kPi);
  cell.width = (phi(cell.x0) - phi(cell.x1)) * std::sin(equal_area);
  cell.height = theta(cell.y1) - theta(cell.y0);
  return cell;
}

std::vector<Cell> cutIntoCells(const Image& image, int count) {
  std::vector<Cell> cells{measured(image, {0.0, double(image.width), 0.0, double(image.height)})};
  while (static_cast<int>(cells.size()) < count) {
    const auto cell = std::max_element(
        cells.begin(), cells.end(), [](const Cell& a, const Cell& b) { return a.priority() < b.priority(); });
    if (!(cell->priority() > 0)) break;
    Cell one{cell->x0, cell->x1, cell->y0, cell->y1}, other = one;
    if (cell->width > cell->height)
      one.x1 = other.x0 = cell->half_x;
    else
      one.y1 = other.y0 = cell->half_y;
    one = measured(image, one);
    other = measured(image, other);
    *cell = luminance(one.rgb) > 0 ? one : other;  // black halves take no beam
    if (luminance(one.rgb) > 0 && luminance(other.rgb) > 0) cells.push_back(other);
  }
  return cells;
}

}  // namespace

Vec3d domeRadiance(const DomeLight& dome, const Vec3d& direction) {
  if (!dome.image) return dome.radiance;
  const Image& image = *dome.image;
  if (image.pixels.empty()) return Vec3d(0);
  const Vec3d from = rotated(-direction, -dome.rotation);
  const double u = 0.5 - std::atan2(from[1], from[0]) / (2 * kPi);
  const double v = std::acos(std::clamp(from[2], -1.0, 1.0)) / kPi;
  const int x = std::clamp(static_cast<int>(u * image.width), 0, image.width - 1);
  const int y = std::clamp(static_cast<int>(v * image.height), 0, image.height - 1);
  return dome.radiance * Vec3d(image.pixels[static_cast<size_t>(y) * image.width + x]);
}

std::vector<Vec3d> sphereDirections(int n) {
  const double golden_angle = kPi * (3 - std::sqrt(5.0));
  std::vector<Vec3d> directions;
  for (int i = 0; i < n; ++i) {
    const double z = 1 - (2.0 * i + 1) / n, r = std::sqrt(1 - z * z), phi = golden_angle * i;
    directions.emplace_back(r * std::cos(phi), r * std::sin(phi), z);
  }
  return directions;
}

std::vector<BeamSample> sampleDome(const DomeLight& dome, int count) {
  std::vector<BeamSample> beams;
  count = std::max(count, 1);
  if (dome.radiance == Vec3d(0)) return beams;
  if (!dome.image) {
    for (const Vec3d& d : sphereDirections(count)) beams.push_back({d, dome.radiance * (4 * kPi / count)});
    return beams;
  }
  if (dome.image->pixels.empty()) return beams;
  for (const Cell& cell : cutIntoCells(*dome.image, count)) {
    const Vec3d irradiance = dome.radiance * cell.rgb;
    if (irradiance == Vec3d(0)) continue;
    Vec3d from = cell.direction;
    if (from.length() < 1e-6 * luminance(cell.rgb)) {  // light from all around: any direction is as good
      const double theta = kPi * 0.5 * (cell.y0 + cell.y1) / dome.image->height;
      const double phi = kPi - kPi * (cell.x0 + cell.x1) / dome.image->width;
      from = Vec3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    }
    beams.push_back({-rotated(from.unit(), dome.rotation), irradiance});
  }
  return beams;
}

}  // namespace vdb_diffuse
