#include <cctype>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "example.h"
#include "grid/norms.h"
#include "io/vdb_reader.h"

namespace vdb_diffuse {
namespace {

using Json = nlohmann::ordered_json;

struct InfoFlags {
  std::string input;
  double sigma_t = 1;
  bool json = false;
};

Json list(const Coord& p) {
  return {p[0], p[1], p[2]};
}
Json list(const Vec3d& v) {
  return {v[0], v[1], v[2]};
}

/// Voxel size and what the axes do, and where the active voxels lie in the world.
void describePlace(const Transform& transform, const Census& counts, Json& out) {
  const double small = 1e-9;
  bool rotated = false;
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < 3; ++k)
      rotated = rotated || (k != a && std::abs(transform.axis(a)[k]) > small * transform.axis(a).length());
  out["voxel_size"] = list(transform.voxelSize());
  out["rotated"] = rotated;
  out["mirrored"] = transform.axis(0).cross(transform.axis(1)).dot(transform.axis(2)) < 0;
  if (counts.active_voxels == 0) return;
  Vec3d low(INFINITY), high(-INFINITY);
  for (int n = 0; n < 8; ++n) {
    const Vec3d corner((n & 4 ? counts.highest[0] + 0.5 : counts.lowest[0] - 0.5),
                       (n & 2 ? counts.highest[1] + 0.5 : counts.lowest[1] - 0.5),
                       (n & 1 ? counts.highest[2] + 0.5 : counts.lowest[2] - 0.5));
    low = openvdb::math::minComponent(low, transform.toWorld(corner));
    high = openvdb::math::maxComponent(high, transform.toWorld(corner));
  }
  out["world_box"] = {list(low), list(high)};
}

void describeDepth(const VdbFile& file, const std::string& name, const Census& counts, double sigma_t,
                   Json& out) {
  const GridValues values = file.readValues(name);
  const Vec3d size = values.transform.voxelSize();
  Json depth;
  depth["sigma_t"] = sigma_t;
  depth["voxel"] = sigma_t * counts.highest_value * std::max({size[0], size[1], size[2]});
  Json columns = Json::array();
  for (int a = 0; a < 3; ++a)
    columns.push_back(sigma_t * size[a] * heaviestColumn(*values.topology, values.channels[0], a));
  depth["column"] = columns;
  out["optical_depth"] = depth;
}

/// Names that a grid of colours goes by, in whatever case.
bool looksLikeAlbedo(std::string name) {
  for (char& letter : name) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  for (const char* usual : {"cd", "albedo", "color", "colour"})
    if (name == usual) return true;
  return false;
}

/// How a grid of colours would serve the density as --albedo-grid.
void describeAlbedo(const VdbFile& file, const std::string& name, Json& out) {
  if (!file.has("density") || name == "density") return;
  const Volume density = file.readDensity("density");
  const VdbFile::Factors factors = file.readFactorsOnto(name, density);
  uint64_t voxels = 0;
  for (size_t i = 0; i < density.values.size(); ++i) voxels += density.values[i] > 0;
  out["albedo"] = {{"density_voxels", voxels}, {"outside", factors.outside}, {"clamped", factors.clamped}};
}

Json describe(const VdbFile& file, const GridSummary& grid, double sigma_t) {
  Json out;
  out["name"] = grid.name;
  out["type"] = grid.value_type;
  out["class"] = grid.grid_class;
  out["half"] = grid.half;
  out["compression"] = grid.compression;
  if (!grid.readable) {
    out["note"] = "holds " + grid.value_type + ", which are not read";
    return out;
  }
  const Census counts = file.readCensus(grid.name);
  out["active_voxels"] = counts.active_voxels;
  out["leaves"] = counts.leaves;
  out["leaf_fill"] =
      counts.leaves ? double(counts.active_leaf_voxels) / (512.0 * double(counts.leaves)) : 0.0;
  out["active_tiles"] = counts.active_tiles;
  if (!counts.tiles_by_width.empty()) {
    const auto& tiles = counts.tiles_by_width;
    out["tiles"] = {{"8", tiles[0]}, {"128", tiles[1]}, {"4096", tiles[2]}};
  }
  if (counts.active_voxels > 0) out["index_box"] = {list(counts.lowest), list(counts.highest)};
  if (counts.has_values) {
    out["values"] = {{"min", counts.lowest_value},   {"max", counts.highest_value},
                     {"mean", counts.mean},          {"zeros", counts.zeros},
                     {"negative", counts.negatives}, {"nonfinite", counts.nonfinites}};
    Json ranges = Json::array(), background = Json::array();
    for (const Census::Component& c : counts.components) {
      ranges.push_back({c.lowest, c.highest});
      background.push_back(c.background);
    }
    out["values"]["components"] = ranges;
    out["background"] = background;
  }
  // What is odd about a grid is told, and does not keep the others from being listed.
  try {
    describePlace(transformOf(*file.readGrid(grid.name)), counts, out);
    const bool fog =
        (grid.value_type == "float" || grid.value_type == "double") && grid.grid_class != "level set";
    if (looksLikeAlbedo(grid.name))
      describeAlbedo(file, grid.name, out);
    else if (fog && counts.nonfinites == 0)
      describeDepth(file, grid.name, counts, sigma_t, out);
  } catch (const InputError& error) {
    out["note"] = error.what();
  }
  return out;
}

std::string number(const Json& value) {
  if (!value.is_number_float()) return value.dump();
  char text[40];
  std::snprintf(text, sizeof text, "%.6g", value.get<double>());
  return text;
}

std::string triple(const Json& v) {
  return "(" + number(v[0]) + ", " + number(v[1]) + ", " + number(v[2]) + ")";
}

void printVoxels(const Json& grid) {
  std::cout << "  active voxels  " << grid["active_voxels"] << " in " << grid["leaves"] << " leaves ("
            << number(100 * grid["leaf_fill"].get<double>()) << " % full) and " << grid["active_tiles"]
            << " tiles";
  if (grid.contains("tiles"))
    std::cout << " (8^3: " << grid["tiles"]["8"] << ", 128^3: " << grid["tiles"]["128"]
              << ", 4096^3: " << grid["tiles"]["4096"] << ")";
  std::cout << "\n";
}

void print(const Json& grid) {
  std::cout << "grid " << grid["name"].get<std::string>() << ": " << grid["type"].get<std::string>()
            << (grid["half"] ? " (stored in 16 bits)" : "") << ", " << grid["class"].get<std::string>();
  const std::string compression = grid["compression"];
  if (!compression.empty()) std::cout << ", compression " << compression;
  std::cout << "\n";
  if (grid.contains("active_voxels")) printVoxels(grid);
  if (grid.contains("voxel_size"))
    std::cout << "  voxel size     " << triple(grid["voxel_size"]) << (grid["rotated"] ? ", rotated" : "")
              << (grid["mirrored"] ? ", mirrored" : "") << "\n";
  if (grid.contains("index_box"))
    std::cout << "  index box      " << triple(grid["index_box"][0]) << " .. " << triple(grid["index_box"][1])
              << "\n";
  if (grid.contains("world_box"))
    std::cout << "  world box      " << triple(grid["world_box"][0]) << " .. " << triple(grid["world_box"][1])
              << "\n";
  if (grid.contains("values")) {
    const Json& v = grid["values"];
    std::cout << "  values         " << number(v["min"]) << " .. " << number(v["max"]) << ", mean "
              << number(v["mean"]) << "; " << v["zeros"] << " zero, " << v["negative"] << " negative, "
              << v["nonfinite"] << " not finite\n";
    if (v["components"].size() > 1) {
      std::cout << "  components     ";
      for (size_t c = 0; c < v["components"].size(); ++c)
        std::cout << (c ? "; " : "") << number(v["components"][c][0]) << " .. "
                  << number(v["components"][c][1]);
      std::cout << "\n";
    }
    std::cout << "  background     ";
    for (size_t c = 0; c < grid["background"].size(); ++c)
      std::cout << (c ? ", " : "") << number(grid["background"][c]);
    std::cout << "\n";
  }
  if (grid.contains("albedo")) {
    const Json& albedo = grid["albedo"];
    std::cout << "  as albedo      by --albedo-grid " << grid["name"].get<std::string>() << ": of "
              << albedo["density_voxels"] << " voxels of the density, " << albedo["outside"]
              << " take the background and " << albedo["clamped"] << " are clamped to 0..1\n";
  }
  if (grid.contains("optical_depth")) {
    const Json& depth = grid["optical_depth"];
    std::cout << "  optical depth  for sigma_t " << number(depth["sigma_t"]) << ": " << number(depth["voxel"])
              << " in the densest voxel; longest column along x " << number(depth["column"][0]) << ", y "
              << number(depth["column"][1]) << ", z " << number(depth["column"][2]) << "\n";
  }
  if (grid.contains("note")) std::cout << "  note           " << grid["note"].get<std::string>() << "\n";
}

void runInfo(const InfoFlags& flags) {
  const VdbFile file(flags.input);
  Json all;
  all["file"] = flags.input;
  all["grids"] = Json::array();
  for (const GridSummary& grid : file.grids()) all["grids"].push_back(describe(file, grid, flags.sigma_t));
  if (flags.json) {
    std::cout << all.dump(2, ' ', false, Json::error_handler_t::replace) << "\n";
    return;
  }
  if (all["grids"].empty()) std::cout << "no grids\n";
  for (const Json& grid : all["grids"]) print(grid);
}

}  // namespace

void addInfo(CLI::App& program, ExitStatus&) {
  CLI::App* command =
      program.add_subcommand("info", "What is in a VDB file: grids, voxels, values, optical depths");
  const auto flags = std::make_shared<InfoFlags>();
  command->add_option("IN", flags->input, "VDB file")->required();
  command
      ->add_option("--sigma-t", flags->sigma_t,
                   "extinction per unit density, 1/(length density), for the optical depths")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--json", flags->json, "print JSON");
  setExample(command, "vdb_diffuse info cloud.vdb --sigma-t 2");
  command->callback([flags] { runInfo(*flags); });
}

}  // namespace vdb_diffuse
