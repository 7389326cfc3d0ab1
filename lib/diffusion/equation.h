#pragma once

#include "diffusion/first_scatter.h"
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
// The first takes the flux to be the same from one centre to the other. What scatters in the half voxel
// before a face adds
//
//     u = 2 r sigma_s rho h ( share Q0/8 + ahead(tau) Q1_flux.n )         n toward the face
//
// to I on the way to it, so that (h/2) q.n becomes (h/2) q.n + u on either side. `share` is how much of the
// source leaves along this axis: all of it where only this axis has an open face, a third in the interior;
// `ahead` is how a beam that dies within the voxel scatters on the side where it comes in (source_shape.h).
// Linear in the light. See Furnace.ThickVoxelsScatterWhereTheLightIs.

struct EquationSettings {
  bool staircase = true;                           ///< use area factors; otherwise a = 1
  std::shared_ptr<const Field<float>> returned;    ///< on the area factors; null: all 1
  double cap = 0;                                  ///< L, world units; infinity: none
  std::shared_ptr<const Walls> walls;              ///< may be null
  const std::vector<Surface>* surfaces = nullptr;  ///< whose albedos the walls have
};

/// The left-hand side for one channel of a medium; what the right-hand side needs is kept with it.
struct Equation {
  std::shared_ptr<const Operator> A;
  ChannelOptics optics;
  double h = 1;                            ///< world units
  std::array<double, 3> stretch{1, 1, 1};  ///< voxel size along each axis over h
  EquationSettings settings;
  int channel = 0;
  size_t floored_voxels = 0;  ///< voxels whose density counts as a vacuum; 0 with a cap
};

/// \throws InputError where nothing absorbs and nothing escapes: the system is singular
Equation formEquation(const Medium& medium, const ChannelOptics& optics, int channel, Model model,
                      const EquationSettings& settings);

struct RightHandSide {
  Field<float> b;
  double scattered_in = 0, emitted = 0;  ///< sums over voxels of h sigma_s rho Q0 and h sigma_a rho Q
  double drive_out = 0;                  ///< flux that the drive alone sends out through open faces, summed
};

/// \param Q0  source field, W/m2/sr;  \param Q1_flux  the vector mean of the beam along grid axes (Q1 = 3 g
/// of it) or null where g' = 0;  \param scale  factor on everything, a power of two
RightHandSide formRightHandSide(const Equation& equation, const Medium& medium, const Field<float>& Q0,
                                const VectorField* Q1_flux, double scale);

/// What drives the diffuse light; Q0 null for light without sources of its own.
struct BeamSource {
  const Field<float>* Q0 = nullptr;
  const VectorField* Q1_flux = nullptr;
  double scale = 1;  ///< factor on both; I0 and the results have it already
};

/// I1 / 3, the flux of I0 per area along the grid axes, at a voxel's centre (the mean of its two faces), and
/// the slope of I0 from its lower to its upper face. Either may be null.
void diffusiveFlux(const Equation& equation, const Medium& medium, const Field<double>& I0,
                   const BeamSource& beams, VectorField* flux, VectorField* slope = nullptr);

}  // namespace vdb_diffuse
