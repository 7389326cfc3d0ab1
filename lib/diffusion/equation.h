#pragma once

#include <limits>

#include "diffusion/first_scatter.h"
#include "diffusion/voxel_profile.h"
#include "diffusion/walls.h"
#include "multigrid/operator.h"

namespace vdb_diffuse {

// The diffusion equation of Stam (1995), corrected, as a resistor network on the voxels.
//
// Two moments of the transport equation with <1> = 1, <s> = 0, <s s> = Id/3 (I_d = I0 + I1.s) give
//
//     -div( D (grad I0 - sigma_s rho Q1) ) + sigma_a rho I0 = sigma_s rho Q0 + sigma_a rho Q
//     I1 = 3 D (-grad I0 + sigma_s rho Q1),     D = 1 / (3 max(sigma_tr rho, 1/L))
//
// and, n inward, I0 - 2 D (dI0/dn - sigma_s rho n.Q1) = 0 on the boundary: no light comes in. Where the paper
// prints something else:
//
//   - eq. 1 has + before the three gain terms; they are -
//   - after eq. 3, div I1 lacks the factor 1/3 of <s s>: hence kappa = 1/(sigma_tr rho) in eq. 6 is 3 D, and
//     the Q1 terms of eqs. 6 and 7 lack a third. See Equation.DecayLengthMatchesP1.
//   - the Q0 term of S has sigma_t; eq. 4 itself has sigma_s
//   - the stencil of section 4.1 is neither conservative nor dimensionally possible; a face takes the
//   harmonic
//     mean of its two D
//
// Model::kPaper keeps kappa and sigma_t as printed on this same stencil. 1/L bounds D where the density
// vanishes, and the drive has that same D.
//
// Finite volumes, everything in units of the mean voxel size h (all coefficients are optical depths, formed
// once in double). Half a voxel has the resistance r = 1/(2D), an open face 2/a more (a: area factor), a wall
// of albedo R 2(1+R)/(1-R)/a; with q = sigma_s rho Q1 the flux of I0 per area is
//
//     from voxel i to voxel j, n from i to j:   ( I_i - I_j + (h/2)(q_i + q_j).n ) / ( r_i + r_j )
//     out through the surface, n outward:       ( I_i + (h/2) q_i.n ) / ( r_i + 2/a )
//
// so neither density zero nor infinity is a special case.
//
// These are the forms of Model::kP1 and kPaper. They take the unknown for a voxel's centre value and its
// light for even, which thick voxels belie: what scatters in one does so where the beam comes in, and what is
// absorbed is absorbed where the light is. So the unknown is the mean over the voxel, and u, the way from it
// to a face, is solved for exactly along the axis (voxel_profile.h): r becomes r_odd, I becomes a I, and
// (h/2) q.n becomes (h/2) q.n + u with
//
//     u = r h ( even share S0 + lean S1.n + spread S2 )                   n toward the face
//
// of S = sigma_s rho Q0 + sigma_a rho Q and its moments along the axis. `share` is how much of what scatters
// leaves along this axis: all of it where only this axis has an open face, a third in the interior; of what
// glows, and of what is absorbed, always all, so that a voxel is seen in another as the other is in it.
// Linear in the light, exact in one dimension. See Slab.ThickVoxelsHaveTheirMeans.

struct EquationSettings {
  bool staircase = true;                         ///< use area factors; otherwise a = 1
  std::shared_ptr<const Field<float>> returned;  ///< on the area factors; null: all 1
  float least_returned = 0;  ///< bound on those, for an equation that must not hold back light
  double cap = 0;            ///< L, world units; infinity: none
  bool profile = true;       ///< of the light within voxels; otherwise values at centres
  double most_resistance = std::numeric_limits<double>::infinity();  ///< bound on r, in mean voxel sizes
  bool diagonal = true;                            ///< form the operator's diagonal, which multigrid needs
  double opening = 1;                              ///< factor on the conductance of open faces
  std::shared_ptr<const Walls> walls;              ///< may be null
  const std::vector<Surface>* surfaces = nullptr;  ///< whose albedos the walls have
};

/// A face of a voxel that leads out of the medium, beside an inactive voxel, or to a wall.
struct OpenFace {
  uint16_t voxel;  ///< in its block
  uint8_t face;    ///< Topology::Face
  float g;         ///< conductance; 0 where a wall lets nothing pass
};

/// One for each of an equation's open faces, by block.
using FaceValues = std::vector<std::vector<float>>;

/// The left-hand side for one channel of a medium; what the right-hand side needs is kept with it.
struct Equation {
  std::shared_ptr<const Operator> A;  ///< on a times the mean; its half resistances are r_odd
  ChannelOptics optics;
  double h = 1;                            ///< world units
  std::array<double, 3> stretch{1, 1, 1};  ///< voxel size along each axis over h
  EquationSettings settings;
  int channel = 0;
  double resistance_per_depth = 1.5,
         least_depth = 0;                   ///< r of a transport optical depth, and the least depth
  size_t floored_voxels = 0;                ///< voxels whose density counts as a vacuum; 0 with a cap
  std::vector<std::vector<OpenFace>> open;  ///< by block, sorted by face and voxel

  /// \param there  the optics in the voxel
  VoxelProfile profile(const ChannelOptics& there, float rho) const {
    return profile(there.sigma_tr, there.sigma_a, rho);
  }
  VoxelProfile profile(double sigma_tr, double sigma_a, float rho) const;
  /// Is the unknown anything but the mean?
  bool scalesMeans() const { return settings.profile && optics.absorbs(); }
};

/// \throws InputError where nothing absorbs and nothing escapes: the system is singular
Equation formEquation(const Medium& medium, const ChannelOptics& optics, int channel, Model model,
                      const EquationSettings& settings);

/// What drives the diffuse light: the beams of first_scatter.h as the equation sees them, and what glows.
struct BeamSource {
  const Field<float>* Q0 = nullptr;  ///< mean of the beams, W/m2/sr; null: no sources at all
  const VectorField* Q1_flux =
      nullptr;  ///< their vector mean along the grid's axes (Q1 = 3 g of it); null: g' = 0
  const BeamShape* shape = nullptr;    ///< where in the voxels they are; null: even
  const Field<float>* glow = nullptr;  ///< radiance that the medium sends out itself; null: none
  double scale = 1;                    ///< factor on everything, a power of two; solutions have it already
  const Field<float>* gathered =
      nullptr;  ///< factor on what scatters in a voxel, see corner_light.h; null: 1
  /// Radiance that comes in at the open faces, beyond what the factors of returned light stand for; has the
  /// scale already. Null: none.
  const FaceValues* incoming = nullptr;
};

struct RightHandSide {
  Field<float> b;
  double scattered_in = 0, emitted = 0;  ///< sums over voxels of h sigma_s rho Q0 and h sigma_a rho Q
  double drive_out = 0;                  ///< flux that the sources alone send out through open faces, summed
};

/// Without `incoming`. \param heads  out: what sources add on the way to each open face; may be null
RightHandSide formRightHandSide(const Equation& equation, const Medium& medium, const BeamSource& beams,
                                FaceValues* heads = nullptr);
void addIncoming(const Equation& equation, const FaceValues& incoming, RightHandSide& rhs);

/// From the solution of the linear system to the means over the voxels, in place.
void meansOfSolution(const Equation& equation, const Medium& medium, Field<double>& x);

/// Flux of light with the means I0 through all open faces, without what the sources add there, in mean voxel
/// sizes squared.
template <typename T>
double escapedThrough(const Equation& equation, const Medium& medium, const Field<T>& I0);

/// I1 / 3, the flux of I0 per area along the grid axes, at a voxel's centre (the mean of its two faces), and
/// the slope of I0, that of the straight line with its first moment, per voxel. Either may be null.
void diffusiveFlux(const Equation& equation, const Medium& medium, const Field<double>& I0,
                   const BeamSource& beams, VectorField* flux, VectorField* slope = nullptr);

}  // namespace vdb_diffuse
