#include "paper/claim.h"

#include <gtest/gtest.h>

#include <cmath>

#include "paper/part.h"

namespace vdb_diffuse {
namespace {

std::string words(Criterion criterion, double promised, double measured, double slack = 2) {
  return Claim{"", "", "", "", criterion, promised, measured, slack}.verdictWords();
}

TEST(Claim, VerdictFollowsFromTheMeasurement) {
  EXPECT_EQ(words(Criterion::kAtMost, 0.1, 0.09), "holds");
  EXPECT_EQ(words(Criterion::kAtMost, 0.1, 0.15), "holds within 1.5 x");
  EXPECT_EQ(words(Criterion::kAtMost, 0.1, 0.21), "does not hold");
  EXPECT_EQ(words(Criterion::kAtLeast, 10, 12), "holds");
  EXPECT_EQ(words(Criterion::kAtLeast, 10, 8), "holds within 1.25 x");
  EXPECT_EQ(words(Criterion::kAtLeast, 10, 4.9), "does not hold");
  EXPECT_EQ(words(Criterion::kEqual, 2, 2.03), "holds");
  EXPECT_EQ(words(Criterion::kEqual, 2, 1.6), "holds within 1.25 x");
  EXPECT_EQ(words(Criterion::kEqual, 2, 0.9), "does not hold");
}

TEST(Claim, NothingThatIsNoNumberHolds) {
  for (const Criterion criterion : {Criterion::kAtMost, Criterion::kAtLeast, Criterion::kEqual})
    for (const double measured : {std::nan(""), HUGE_VAL})
      EXPECT_EQ(words(criterion, 1, measured, 1e9), "does not hold");
  EXPECT_EQ(words(Criterion::kAtMost, 0.1, -3), "holds");
  EXPECT_EQ(words(Criterion::kAtLeast, 0.1, -3, 1e9), "does not hold");
  EXPECT_EQ(words(Criterion::kEqual, 0.1, -0.1, 1e9), "does not hold");
}

TEST(Claim, CsvQuotesWhatNeedsIt) {
  Csv csv({"a", "b"});
  csv.row({"one, two", "say \"no\""});
  EXPECT_EQ(csv.text(), "a,b\n\"one, two\",\"say \"\"no\"\"\"\n");
}

}  // namespace
}  // namespace vdb_diffuse
