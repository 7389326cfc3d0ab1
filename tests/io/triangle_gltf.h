#pragma once

#include <cstdint>
#include <string>

namespace vdb_diffuse {

/// Raw bytes as the data URI of a glTF buffer.
inline std::string dataUri(const std::string& bytes) {
  const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text = "data:application/octet-stream;base64,";
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? digits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// The parts of a glTF file with one triangle (0,0,0) (1,0,0) (0,1,0) in its own axes.
struct TriangleGltf {
  float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  uint16_t indices[4] = {0, 1, 2, 0};
  std::string nodes = R"([{"mesh": 0, "name": "wall"}])", roots = "[0]", materials = "[]", material, extra;

  std::string json(bool glb = false) const {
    std::string mesh = R"({"attributes": {"POSITION": 0}, "indices": 1)" + material + "}";
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": )" + roots + R"(}], "nodes": )" +
           nodes + R"(, "meshes": [{"primitives": [)" + mesh + R"(]}], "materials": )" + materials +
           R"(, "accessors": [
             {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0,0,0], "max": [1,1,0]},
             {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
             "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
             "buffers": [{"byteLength": 44)" +
           (glb ? "" : R"(, "uri": ")" + dataUri(buffer()) + '"') + "}]" + extra + "}";
  }
  std::string buffer() const {
    return std::string(reinterpret_cast<const char*>(positions), 36) +
           std::string(reinterpret_cast<const char*>(indices), 8);
  }
  std::string glb() const {
    const auto word = [](size_t n) {
      std::string bytes;
      for (int i = 0; i < 4; ++i) bytes += static_cast<char>(n >> (8 * i));
      return bytes;
    };
    std::string text = json(true);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    return "glTF" + word(2) + word(12 + 8 + text.size() + 8 + 44) + word(text.size()) + "JSON" + text +
           word(44) + std::string("BIN\0", 4) + buffer();
  }
};

}  // namespace vdb_diffuse
