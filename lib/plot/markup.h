#pragma once

#include <string>

namespace vdb_diffuse {

/// Text as XML and SVG write it, between tags or in an attribute. `?` stands for control characters, for
/// which XML 1.0 knows no way; newlines and tabs stay.
std::string escapedMarkup(const std::string& text);

}  // namespace vdb_diffuse
