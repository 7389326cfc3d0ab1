#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace vdb_diffuse {

/// Bytes of a file that is regular and has at most `largest`. \throws InputError naming the path
size_t regularFileSize(const std::string& path, size_t largest);

/// A regular file of at most `largest` bytes, whole. \throws InputError naming the path
std::string readWholeFile(const std::string& path, size_t largest);

/// JSON text of bounded depth and count of values, without doubled keys. They are counted on the text, before
/// any parser sees it. \throws InputError naming `path`
nlohmann::json parseJson(const std::string& text, const std::string& path);

/// Text from a file as part of a message: one line, not too long.
std::string printable(std::string_view text);

/// Extension in lower case with its dot: ".glb".
std::string extensionOf(const std::string& path);

}  // namespace vdb_diffuse
