#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse {

enum class Verdict { kHolds, kHoldsWithin, kDoesNotHold };

/// How a claim is held against a measurement.
enum class Criterion {
  kAtMost,   ///< measured <= promised
  kAtLeast,  ///< measured >= promised
  kEqual     ///< within `kSame` of each other
};
constexpr double kSame = 0.02;  ///< relative: nobody would speak of a difference

/// Something the paper says, what came out, and what follows from the two.
struct Claim {
  std::string part;      ///< that measured it
  std::string section;   ///< of the paper
  std::string words;     ///< the claim in a few words
  std::string quantity;  ///< what was measured, with its unit
  Criterion criterion = Criterion::kAtMost;
  double promised = 0, measured = 0;
  /// How far off, as a factor >= 1, still counts as "holds within".
  double slack = 1;

  /// Measured over promised or the other way round, what is above 1 being worse. NaN is infinitely worse.
  double factor() const;
  Verdict verdict() const;
  std::string verdictWords() const;  ///< "holds", "holds within 1.4 x", "does not hold"
};

std::string claimsCsv(const std::vector<Claim>& claims);
/// The same for the eye.
std::string claimsTable(const std::vector<Claim>& claims);

}  // namespace vdb_diffuse
