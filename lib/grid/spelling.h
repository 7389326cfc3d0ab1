#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse {

/// The candidate that a mistyped word most likely means: fewest single-letter changes, the first where
/// several have as few. Empty where none is near (more than two changes, and more than a third of the word).
std::string nearestSpelling(const std::string& word, const std::vector<std::string>& candidates);

/// "a, b, c"
std::string commaList(const std::vector<std::string>& words);

}  // namespace vdb_diffuse
