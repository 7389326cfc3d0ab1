#include "paper/claim.h"

#include <algorithm>
#include <cmath>

#include "paper/part.h"

namespace vdb_diffuse {
namespace {

const char* sign(Criterion criterion) {
  return criterion == Criterion::kAtMost ? "<=" : criterion == Criterion::kAtLeast ? ">=" : "=";
}

}  // namespace

double Claim::factor() const {
  if (!std::isfinite(measured)) return HUGE_VAL;
  if (measured == promised) return 1;
  if (!(measured > 0 && promised > 0)) {  // no ratio: it is met, or it is not
    const bool met = criterion == Criterion::kAtMost
                         ? measured <= promised
                         : criterion == Criterion::kAtLeast && measured >= promised;
    return met ? 0 : HUGE_VAL;
  }
  const double over = measured / promised;
  return criterion == Criterion::kAtMost    ? over
         : criterion == Criterion::kAtLeast ? 1 / over
                                            : std::max(over, 1 / over);
}

Verdict Claim::verdict() const {
  const double f = factor();
  if (f <= (criterion == Criterion::kEqual ? 1 + kSame : 1)) return Verdict::kHolds;
  return f <= slack ? Verdict::kHoldsWithin : Verdict::kDoesNotHold;
}

std::string Claim::verdictWords() const {
  switch (verdict()) {
    case Verdict::kHolds:
      return "holds";
    case Verdict::kHoldsWithin:
      return "holds within " + number(factor(), "%.3g") + " x";
    default:
      return "does not hold";
  }
}

std::string claimsCsv(const std::vector<Claim>& claims) {
  Csv csv({"part", "section", "claim", "quantity", "measured", "criterion", "promised", "slack", "verdict"});
  for (const Claim& c : claims)
    csv.row({c.part, c.section, c.words, c.quantity, number(c.measured), sign(c.criterion),
             number(c.promised), number(c.slack), c.verdictWords()});
  return csv.text();
}

std::string claimsTable(const std::vector<Claim>& claims) {
  std::vector<std::vector<std::string>> lines{{"section", "claim", "measured", "paper", "verdict"}};
  for (const Claim& c : claims)
    lines.push_back({c.section, c.words, number(c.measured, "%.3g") + " " + c.quantity,
                     std::string(sign(c.criterion)) + " " + number(c.promised, "%.3g"), c.verdictWords()});
  std::vector<size_t> width(lines[0].size(), 0);
  for (const auto& line : lines)
    for (size_t n = 0; n < line.size(); ++n) width[n] = std::max(width[n], line[n].size());
  std::string out;
  for (const auto& line : lines) {
    std::string row;
    for (size_t n = 0; n < line.size(); ++n)
      row += (n > 0 ? "  " : "") + line[n] + std::string(width[n] - line[n].size(), ' ');
    row.erase(row.find_last_not_of(' ') + 1);
    out += row + "\n";
  }
  return out;
}

}  // namespace vdb_diffuse
