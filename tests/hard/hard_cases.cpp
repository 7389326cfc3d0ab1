#include "hard/hard_cases.h"

#include <cmath>
#include <memory>

#include "volumes.h"

namespace vdb_diffuse {
namespace {

using Density = std::function<double(Coord)>;

constexpr int kWidth = 14;  // voxels
constexpr double kStep = 0.5;
const Vec3d kSun(0.3, 0.2, -1);

Medium mediumOf(const Density& rho, double sigma_s = 1, double sigma_a = 0.05, double g = 0,
                const Transform& transform = Transform::uniform(kStep), const Coord& size = Coord(kWidth),
                const Coord& offset = Coord(0)) {
  Medium medium = boxMedium(size, transform, rho, offset);
  medium.optics.sigma_s = Vec3d(sigma_s);
  medium.optics.sigma_a = Vec3d(sigma_a);
  medium.optics.g = g;
  return medium;
}

Medium glowing(
    Medium medium, const Density& Q = [](Coord) { return 1.0; }) {
  setEmission(medium, Q);
  return medium;
}

Density constant(double rho) {
  return [=](Coord) { return rho; };
}
/// 10^low .. 10^high, each voxel for itself.
Density logUniform(double low, double high) {
  return [=](Coord p) { return std::pow(10, low + (high - low) * hashed(p, 5)); };
}
Density checkerboard(double contrast, int cell) {
  return [=](Coord p) { return (p[0] / cell + p[1] / cell + p[2] / cell) % 2 ? contrast : 1; };
}
Density logNormal(double decades) {
  return [=](Coord p) {
    const double u = 1 - hashed(p, 1), v = hashed(p, 2);
    return std::pow(10, decades / 3 * std::sqrt(-2 * std::log(u)) * std::cos(2 * M_PI * v));
  };
}

Scene lampScene(const Vec3d& position) {
  Scene scene;
  scene.lights.push_back({"lamp", PointLight{position, Vec3d(1), 0}});
  return scene;
}

/// A box of mirrors about the voxels, with a lamp in it.
Scene closedScene() {
  Scene scene = lampScene(Vec3d(1.1, 2.2, 3.1));
  const double low = -0.5 * kStep, side = kWidth * kStep;
  for (int a = 0; a < 3; ++a)
    for (const double at : {low, low + side}) {
      Vec3d p(low), u(0), v(0);
      p[a] = at;
      u[(a + 1) % 3] = v[(a + 2) % 3] = side;
      scene.surfaces.push_back({"mirror", quad(p, u, v), Vec3d(1)});
    }
  return scene;
}

bool allWithin(const DiffuseResult& result, const Topology& topology, double value, double tolerance) {
  bool all = true;
  forEachVoxel(topology, [&](Coord, size_t i) {
    all = all && std::abs(result.diffuse[0][i] - value) <= tolerance * std::abs(value);
  });
  return all;
}

/// The diffuse light of a P1 solve to a tight tolerance, without sweeps.
Field<float> solved(const Medium& medium, const Scene& scene, Model model, double tolerance) {
  DiffuseSettings settings;
  settings.model.model = model;
  settings.tolerance = tolerance;
  return diffuse(medium, scene, settings).diffuse[0];
}

/// Largest |a - b| / b of any voxel.
double worstRatio(const Topology& topology, const Field<float>& a, const Field<float>& b) {
  double worst = 0;
  forEachVoxel(topology, [&](Coord, size_t i) {
    if (a[i] != b[i]) worst = std::max(worst, std::abs(double(a[i]) - b[i]) / std::abs(b[i]));
  });
  return worst;
}

/// Every voxel is where a solve to 1e-9 has it. The norm of a solve is one over all voxels, so that to know
/// the dimmest to 1e-4 takes a tighter tolerance than that.
HardCase toTheLastVoxel(const std::string& name, const Density& rho, int most_iterations) {
  HardCase hard{name, glowing(mediumOf(rho)), sunScene(kSun), "each voxel within 1e-4 of a solve to 1e-9"};
  hard.tolerance = 1e-6;
  hard.most_iterations = most_iterations;
  hard.holds = [medium = hard.medium, scene = hard.scene](const DiffuseResult& result) {
    const Field<float> best = solved(medium, scene, Model::kDefault, 1e-9);
    return worstRatio(medium.topology(), result.diffuse[0], best) <= 1e-4;
  };
  return hard;
}

void addOptics(std::vector<HardCase>& cases) {
  const Scene sun = sunScene(kSun);
  HardCase conservative{"albedo exactly 1", mediumOf(constant(1), 1, 0), sun, "nothing is absorbed"};
  conservative.holds = [](const DiffuseResult& r) { return r.energy.absorbed == 0 && r.energy.escaped > 0; };
  conservative.others = true;
  cases.push_back(conservative);

  HardCase black{"albedo 0 and no emission", mediumOf(constant(1), 0, 1), sun, "zeros, and no iteration"};
  black.holds = [t = black.medium.density.topology](const DiffuseResult& r) {
    return r.iterations == 0 && allWithin(r, *t, 0, 0);
  };
  black.others = true;
  cases.push_back(black);

  HardCase dark{"all-zero source", mediumOf(constant(1)), Scene{}, "zeros, no iteration, a warning"};
  dark.holds = [t = dark.medium.density.topology](const DiffuseResult& r) {
    return r.iterations == 0 && allWithin(r, *t, 0, 0) && r.warnings.size() == 1;
  };
  dark.others = true;
  cases.push_back(dark);

  HardCase closed{"albedo 1 in a box of mirrors", mediumOf(constant(1), 1, 0), closedScene(),
                  "refused: singular"};
  closed.refused = true;
  cases.push_back(closed);

  for (const double g : {0.999, -0.999}) {
    HardCase forward{"g = " + std::to_string(g).substr(0, g > 0 ? 5 : 6), mediumOf(constant(1), 1, 0.05, g),
                     sun, ""};
    forward.others = true;
    cases.push_back(forward);
  }
  // Where the source does not come from a beam, P1 knows g by the transport coefficient alone.
  HardCase similar{"g = 0.999, source given, plain P1", glowing(mediumOf(constant(1), 1, 0.05, 0.999)),
                   Scene{}, "as sigma_s (1-g) and g = 0, within 1e-6"};
  similar.model = Model::kP1;
  similar.tolerance = 1e-7;
  similar.holds = [](const DiffuseResult& r) {
    const Medium reduced = glowing(mediumOf(constant(1), 1e-3, 0.05, 0));
    return largestDifference(reduced.topology(), r.diffuse[0], solved(reduced, {}, Model::kP1, 1e-7)) <= 1e-6;
  };
  cases.push_back(similar);

  HardCase plain{"g = 0.85, plain P1: negative light", mediumOf(logUniform(-1, 1), 1, 0, 0.85), sun,
                 "clamped voxels are counted"};
  plain.model = Model::kP1;
  plain.negatives = 1;
  plain.holds = [](const DiffuseResult& r) { return r.negative_voxels > 0; };
  cases.push_back(plain);
}

void addDensities(std::vector<HardCase>& cases) {
  const Scene sun = sunScene(kSun);
  // Of thick voxels beside thin ones some come out a little below zero.
  const auto add = [&](const std::string& name, const Density& rho, bool others = false,
                       double negatives = 1e-6) {
    HardCase hard{name, mediumOf(rho), sun, ""};
    hard.others = others;
    hard.negatives = negatives;
    cases.push_back(hard);
  };
  add("uniform, for comparison", constant(1));
  add("density 1e-12 .. 1e12", logUniform(-12, 12), true, 0.02);
  add("density 1e-6 .. 1e6", logUniform(-6, 6), false, 5e-3);
  add("log-normal over 10^(+-6)", logNormal(6), true);
  add(
      "density 0 in an active cavity",
      [](Coord p) { return (p.asVec3d() - Vec3d(0.5 * (kWidth - 1))).length() < 0.25 * kWidth ? 0 : 1; },
      true);
  add("all-zero density", constant(0), true);
  add("layers of 1 and 0", [](Coord p) { return p[2] / 2 % 2 ? 0 : 1; });
  add("checkerboard 1e6 of voxels", checkerboard(1e6, 1), true);
  add("checkerboard 1e6 of 7 voxels", checkerboard(1e6, 7));
  HardCase uncapped{"density 1e-12 .. 1e12, plain P1, no cap", mediumOf(logUniform(-12, 12)), sun, ""};
  uncapped.model = Model::kP1;
  uncapped.most_iterations = 200;
  cases.push_back(uncapped);
  cases.push_back(toTheLastVoxel("blocks of 7, 1e6: dimmest voxels", checkerboard(1e6, 7), 60));
  cases.push_back(toTheLastVoxel("log-normal over 10^(+-6): dimmest voxels", logNormal(6), 60));

  for (const double depth : {1e-20, 1e-12, 1e-6, 1e-3})
    cases.push_back({"optical depth of a voxel " + std::string(depth > 1e-4    ? "1e-3"
                                                               : depth > 1e-8  ? "1e-6"
                                                               : depth > 1e-15 ? "1e-12"
                                                                               : "1e-20"),
                     mediumOf(constant(depth / kStep)), sun, ""});
  HardCase thick{"optical depth of a voxel 1e6, glowing",
                 glowing(mediumOf(constant(1e6 / kStep), 0.5, 0.5)),
                 {},
                 "inner voxels are in equilibrium within 1e-5"};
  thick.holds = [t = thick.medium.density.topology](const DiffuseResult& r) {
    bool all = true;
    forEachVoxel(*t, [&](Coord p, size_t i) {
      const bool inner =
          p[0] > 0 && p[1] > 0 && p[2] > 0 && p[0] < kWidth - 1 && p[1] < kWidth - 1 && p[2] < kWidth - 1;
      all = all && (!inner || std::abs(r.diffuse[0][i] - 1) <= 1e-5);
    });
    return all;
  };
  cases.push_back(thick);
  const Scene above = sunScene(Vec3d(0, 0, -1));
  HardCase thicker{"optical depth of a voxel 1e4, albedo 1", mediumOf(constant(1e4 / kStep), 1, 0), above,
                   "as of 1e3, within 1e-2"};
  thicker.holds = [above](const DiffuseResult& r) {
    const Medium thick = mediumOf(constant(1e3 / kStep), 1, 0);
    return largestDifference(thick.topology(), r.diffuse[0], solved(thick, above, Model::kDefault, 1e-4)) <=
           1e-2;
  };
  cases.push_back(thicker);
  // Beyond, what floats round off of the light that leaves a voxel is as much as what stays in it.
  for (const double depth : {1e8, 1e20}) {
    HardCase thickest{
        std::string("optical depth of a voxel ") + (depth > 1e8 ? "1e20" : "1e8") + ", albedo 1",
        mediumOf(constant(depth / kStep), 1, 0), above, "finite, balanced; no more is known"};
    thickest.negatives = HUGE_VAL;
    cases.push_back(thickest);
  }
  HardCase oblique{"optical depth of a voxel 1e3, oblique sun", mediumOf(constant(1e3 / kStep), 1, 0), sun,
                   "as of 1e5, within 2e-2"};
  oblique.holds = [sun](const DiffuseResult& r) {
    const Medium thick = mediumOf(constant(1e5 / kStep), 1, 0);
    return largestDifference(thick.topology(), r.diffuse[0], solved(thick, sun, Model::kDefault, 1e-4)) <=
           2e-2;
  };
  cases.push_back(oblique);
}

void addShapes(std::vector<HardCase>& cases) {
  const Scene sun = sunScene(kSun);
  HardCase single{"a single voxel", mediumOf(constant(1), 1, 0.05, 0, Transform::uniform(kStep), Coord(1)),
                  sun, ""};
  single.others = true;
  cases.push_back(single);

  // I0 = tau_a Q / (tau_a + 6 g), g = 1 / (r + 2) the conductance of an open face: P1 in one voxel.
  const auto alone = [](int faces) {
    const double tau_a = 0.5 * kStep, r = 1.5 * 1.5 * kStep;
    return tau_a / (tau_a + faces / (r + 2));
  };
  HardCase islands{
      "one-voxel islands, glowing, plain P1",
      glowing(mediumOf([](Coord p) { return p[0] % 2 || p[1] % 2 || p[2] % 2 ? -1 : 1; }, 1, 0.5)),
      {},
      "tau_a Q / (tau_a + 6 g) within 1e-6"};
  islands.model = Model::kP1;
  islands.others = true;
  islands.holds = [=, t = islands.medium.density.topology](const DiffuseResult& r) {
    return allWithin(r, *t, alone(6), 1e-6);
  };
  cases.push_back(islands);

  HardCase sheet{"one-voxel sheet, glowing, plain P1",
                 glowing(mediumOf(constant(1), 1, 0.5, 0, Transform::uniform(kStep), Coord(61, 61, 1))),
                 {},
                 "middle: tau_a Q / (tau_a + 2 g) within 1e-6"};
  sheet.model = Model::kP1;
  sheet.tolerance = 1e-7;
  sheet.holds = [=, t = sheet.medium.density.topology](const DiffuseResult& r) {
    return std::abs(r.diffuse[0].at(*t, Coord(30, 30, 0)) - alone(2)) <= 1e-6 * alone(2);
  };
  cases.push_back(sheet);

  // Two boxes apart, one of them bright: each has the light that it has by itself.
  const auto boxes = [](bool both) {
    return [=](Coord p) { return p[0] < 5 || (both && p[0] > 8) ? 1.0 : -1.0; };
  };
  const auto bright = [](Coord p) { return p[0] < 5 ? 1.0 : 1000.0; };
  HardCase pieces{"two pieces apart, glowing, plain P1",
                  glowing(mediumOf(boxes(true)), bright),
                  {},
                  "the dim one is as by itself within 1e-3"};
  pieces.model = Model::kP1;
  pieces.holds = [=, t = pieces.medium.density.topology](const DiffuseResult& r) {
    const Medium single_piece = glowing(mediumOf(boxes(false)), bright);
    const Field<float> own = solved(single_piece, {}, Model::kP1, 1e-6);
    double worst = 0, largest = 0;
    forEachVoxel(single_piece.topology(), [&](Coord p, size_t i) {
      worst = std::max(worst, double(std::abs(own[i] - r.diffuse[0].at(*t, p))));
      largest = std::max(largest, double(own[i]));
    });
    return worst <= 1e-3 * largest;
  };
  cases.push_back(pieces);
}

void addTransforms(std::vector<HardCase>& cases) {
  const Scene sun = sunScene(kSun);
  const Density lumpy = [](Coord p) { return lumpyDensity(p); };
  for (const double h : {1e-9, 1e9}) {
    HardCase scaled{h > 1 ? "voxels of 1e9" : "voxels of 1e-9",
                    mediumOf(lumpy, 0.5 / h, 0.02 / h, 0.5, Transform::uniform(h)), sun,
                    "as voxels of 1, within 1e-5"};
    scaled.holds = [=](const DiffuseResult& r) {
      const Medium one = mediumOf(lumpy, 0.5, 0.02, 0.5, Transform::uniform(1));
      return largestDifference(one.topology(), r.diffuse[0], solved(one, sun, Model::kDefault, 1e-4)) <= 1e-5;
    };
    cases.push_back(scaled);
  }
  const auto stretched = [](double h) {
    return Transform(Vec3d(kStep, 0, 0), Vec3d(0, kStep, 0), Vec3d(0, 0, h), Vec3d(0));
  };
  cases.push_back({"voxels 1 : 1 : 10", mediumOf(lumpy, 1, 0.05, 0, stretched(10 * kStep)), sun, ""});
  cases.push_back({"voxels 10 : 10 : 1", mediumOf(lumpy, 1, 0.05, 0, stretched(0.1 * kStep)), sun, ""});
  for (const auto& [name, offset] : {std::pair("across the index origin", Coord(-7)),
                                     std::pair("coordinates near 2^30", Coord((1 << 30) - 64)),
                                     std::pair("coordinates near -2^30", Coord(-(1 << 30) + 64))}) {
    HardCase moved{name, mediumOf(lumpy, 1, 0.05, 0, Transform::uniform(kStep), Coord(kWidth), offset), sun,
                   "as at the origin, within 1e-3"};
    moved.holds = [=, t = moved.medium.density.topology](const DiffuseResult& r) {
      const Medium here = mediumOf(lumpy);
      const Coord by = offset;
      return largestDifference(here.topology(), solved(here, sun, Model::kDefault, 1e-4), *t, r.diffuse[0],
                               [&](Coord p) { return p + by; }) <= 1e-3;
    };
    cases.push_back(moved);
  }
}

void addLights(std::vector<HardCase>& cases) {
  const Vec3d centre(7 * kStep), corner(7.5 * kStep);
  for (const auto& [name, position] :
       {std::pair("lamp on a voxel's centre", centre), std::pair("lamp on a voxel's corner", corner)}) {
    HardCase lamp{name, mediumOf(constant(2), 0.9, 0.1), lampScene(position),
                  "scatters its 4 pi W within 1 %"};
    // What is not scattered is absorbed: the medium is 7 optical depths deep about the lamp.
    lamp.holds = [](const DiffuseResult& r) {
      return std::abs(r.energy.scattered_in / (0.9 * 4 * M_PI) - 1) <= 0.01;
    };
    cases.push_back(lamp);
  }
  for (const double strength : {1e-20, 1e20}) {
    HardCase scaled{strength > 1 ? "a sun of 1e20" : "a sun of 1e-20", mediumOf(constant(1)),
                    sunScene(kSun, Vec3d(strength)), "as one of 1, within 1e-5"};
    scaled.holds = [=](const DiffuseResult& r) {
      const Medium medium = mediumOf(constant(1));
      Field<float> one = solved(medium, sunScene(kSun), Model::kDefault, 1e-4);
      for (size_t i = 0; i < one.size(); ++i) one[i] = static_cast<float>(one[i] * strength);
      return largestDifference(medium.topology(), r.diffuse[0], one) <= 1e-5;
    };
    cases.push_back(scaled);
  }
}

}  // namespace

std::vector<HardCase> hardCases() {
  std::vector<HardCase> cases;
  addOptics(cases);
  addDensities(cases);
  addShapes(cases);
  addTransforms(cases);
  addLights(cases);
  return cases;
}

}  // namespace vdb_diffuse
