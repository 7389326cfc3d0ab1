#pragma once

#include "grid/row.h"

namespace vdb_diffuse {

/// What a segment of optical depth tau >= 0 does to light that passes it, and to light that starts on it:
///
///     e = exp(-tau),   m = (1 - e) / tau,   n = (1 - m) / tau      (1, 1 and 1/2 as tau -> 0)
///
/// With the source J(a) = J0 + a dJ at the fraction a of the segment, light psi that enters leaves as
/// psi e + J0 (1 - e) + dJ (1 - m), and its mean on the segment is psi m + J0 (1 - m) + dJ (1/2 - n).
struct Attenuation {
  Row e, m, n;
};

/// exp(-x) for x >= 0 within 2e-7 of itself; 0 from about 87 on. Cephes' range reduction and polynomial.
VDB_DIFFUSE_INLINE Row exponentialDecay(Row x) {
  constexpr float kLog2E = 1.44269504f, kHigh = 0.693359375f, kLow = -2.12194440e-4f, kLargest = 87;
  const Row y = -(x < kLargest ? x : Row{} + kLargest);
  const RowMask power = __builtin_convertvector(y * kLog2E - 0.5f, RowMask);  // rounds to the nearest
  const Row whole = __builtin_convertvector(power, Row);
  const Row f = (y - whole * kHigh) - whole * kLow;
  const Row series =
      ((((1.9875691500e-4f * f + 1.3981999507e-3f) * f + 8.3334519073e-3f) * f + 4.1665795894e-2f) * f +
       1.6666665459e-1f) *
          f +
      5.0000001201e-1f;
  const Row value = series * f * f + f + 1.0f;
  const RowMask scaled = reinterpret_cast<RowMask>(value) + (power << 23);
  return x < kLargest ? reinterpret_cast<Row>(scaled) : Row{};
}

/// Rows all of whose segments are thin, as most are, are spared the exponential.
VDB_DIFFUSE_INLINE Attenuation attenuationOf(Row tau) {
  constexpr float kSmall = 0.7f;  // below, the series of n leaves out less than 2e-8
  Attenuation thin;
  thin.n =
      1.0f / 2 -
      tau * (1.0f / 6 -
             tau * (1.0f / 24 -
                    tau * (1.0f / 120 -
                           tau * (1.0f / 720 - tau * (1.0f / 5040 - tau * (1.0f / 40320 - tau / 362880))))));
  thin.m = 1.0f - tau * thin.n;
  thin.e = 1.0f - tau * thin.m;
  const RowMask thick = tau >= kSmall;
  if (!anyOf(thick)) return thin;
  const Row e = exponentialDecay(tau), inverse = 1.0f / tau, m = (1.0f - e) * inverse;
  return {thick ? e : thin.e, thick ? m : thin.m, thick ? (1.0f - m) * inverse : thin.n};
}

/// (1/2 - n) / tau, 1/6 as tau -> 0. The mean of a times the light at a is psi (m - n) + J0 tau (n - p) +
/// dJ (1/3 - n + p), p this number.
VDB_DIFFUSE_INLINE Row nextOf(Row tau, Row n) {
  constexpr float kSmall = 0.7f;
  const Row series =
      1.0f / 6 -
      tau * (1.0f / 24 -
             tau * (1.0f / 120 -
                    tau * (1.0f / 720 - tau * (1.0f / 5040 - tau * (1.0f / 40320 - tau / 362880)))));
  const RowMask thick = tau >= kSmall;
  return anyOf(thick) ? (thick ? (0.5f - n) / tau : series) : series;
}

}  // namespace vdb_diffuse
