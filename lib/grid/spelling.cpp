#include "grid/spelling.h"

#include <algorithm>
#include <numeric>

namespace vdb_diffuse {
namespace {

/// Insertions, deletions and replacements of one letter each (Wagner and Fischer 1974), one row at a time.
size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t(0));
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearestSpelling(const std::string& word, const std::vector<std::string>& candidates) {
  std::string nearest;
  size_t fewest = std::max<size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const size_t changes = editDistance(word, candidate);
    if (changes < fewest && changes < candidate.size()) {
      fewest = changes;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string commaList(const std::vector<std::string>& words) {
  std::string list;
  for (const std::string& word : words) list += (list.empty() ? "" : ", ") + word;
  return list;
}

}  // namespace vdb_diffuse
