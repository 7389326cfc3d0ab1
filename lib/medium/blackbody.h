#pragma once

#include "grid/field.h"
#include "grid/transform.h"

namespace vdb_diffuse {

/// What a black body sends out, as a renderer's colour. The spectral radiance is Planck's law,
///
///     B(lambda, T) = (2 h c^2 / lambda^5) / (exp(h c / (lambda k T)) - 1)        W / m^3 / sr
///
/// weighted with the eye's three responses of the CIE 1931 observer and integrated over 360..830 nm:
///
///     (X, Y, Z) = int B (x, y, z)(lambda) dlambda                                W / m^2 / sr
///
/// so that 683 lm/W times Y is the luminance in cd/m^2, the factor by which glTF's lights are divided too.
/// Linear Rec. 709 follows by its matrix, with white at D65. Below about 1900 K the colour lies outside what
/// Rec. 709 can show and blue would be negative: it is set to zero, and red and green keep the luminance.
/// The responses are the Gaussians that Wyman, Sloan and Shirley (2013, "Simple Analytic Approximations to
/// the CIE XYZ Color Matching Functions", JCGT 2(2), multi-lobe fit) give: within about one per cent.
/// \param kelvin  temperature, >= 0
Vec3d blackbodyXyz(double kelvin);
Vec3d blackbodyRgb(double kelvin);

constexpr double kHottest = 1e6;  ///< kelvin; what is hotter is taken for a slip of the pen

/// Q as red, green and blue from a field of temperatures. \param kelvin   per unit of the field
/// \param intensity   factor on the radiance \throws InputError where one is above kHottest
Channels blackbodyField(const Field<float>& temperature, double kelvin, double intensity);

}  // namespace vdb_diffuse
