#include "render/render.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>

#include "commands.h"
#include "io/image.h"
#include "lit_volume.h"

namespace vdb_diffuse {
namespace {

/// The flags as they were typed; empty where they were not.
struct Words {
  std::string input, output, size = "960x540";
  std::string from, look_at, fov, ortho, up = "z", exposure, background, light = "both";
  std::string density, emission, emission_scale, sigma_s, sigma_a, sigma_t, albedo, g;
  int samples = 2, threads = 0;
  bool constant_voxels = false, half = false, quiet = false;
};

std::vector<double> numbers(const std::string& flag, const std::string& text) {
  std::vector<double> values;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) {
    char* end = nullptr;
    const double value = std::strtod(part.c_str(), &end);
    if (part.empty() || *end != 0 || !std::isfinite(value))
      throw UsageError(flag + ": '" + text + "' is not a number or a list x,y,z of numbers");
    values.push_back(value);
  }
  if (text.back() == ',') throw UsageError(flag + ": '" + text + "' ends in a comma");
  return values;
}

double number(const std::string& flag, const std::string& text) {
  const std::vector<double> values = numbers(flag, text);
  if (values.size() != 1) throw UsageError(flag + ": '" + text + "' is not one number");
  return values[0];
}

Vec3d point(const std::string& flag, const std::string& text) {
  const std::vector<double> values = numbers(flag, text);
  if (values.size() != 3) throw UsageError(flag + ": '" + text + "' is not X,Y,Z");
  return Vec3d(values[0], values[1], values[2]);
}

/// r,g,b or one number for grey, none negative.
Vec3d colour(const std::string& flag, const std::string& text) {
  std::vector<double> values = numbers(flag, text);
  if (values.size() == 1) values.assign(3, values[0]);
  if (values.size() != 3) throw UsageError(flag + ": '" + text + "' is neither r,g,b nor one number");
  if (*std::min_element(values.begin(), values.end()) < 0) throw UsageError(flag + ": a value is negative");
  return Vec3d(values[0], values[1], values[2]);
}

CameraSettings cameraOf(const Words& words) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  constexpr long kMostPixels = 1L << 28;
  CameraSettings camera;
  char rest = 0;
  if (std::sscanf(words.size.c_str(), "%dx%d%c", &camera.width, &camera.height, &rest) != 2 ||
      camera.width < 1 || camera.height < 1 || static_cast<long>(camera.width) * camera.height > kMostPixels)
    throw UsageError("--size: '" + words.size + "' is not WxH, such as 960x540");
  if (!words.from.empty()) camera.from = point("--from", words.from);
  if (!words.look_at.empty()) camera.look_at = point("--look-at", words.look_at);
  if (!words.fov.empty()) camera.fov = number("--fov", words.fov) * kDegree;
  if (!words.ortho.empty()) camera.ortho = number("--ortho", words.ortho);
  if (words.up != "y" && words.up != "z") throw UsageError("--up: '" + words.up + "' is neither y nor z");
  if (words.up == "y") camera.up = Vec3d(0, 1, 0);
  return camera;
}

LitVolumeSettings mediumOf(const Words& words) {
  LitVolumeSettings settings;
  settings.density = words.density;
  settings.emission = words.emission;
  if (!words.emission_scale.empty()) {
    settings.emission_scale = number("--emission-scale", words.emission_scale);
    if (*settings.emission_scale < 0) throw UsageError("--emission-scale: a value is negative");
  }
  if (!words.sigma_s.empty()) settings.sigma_s = colour("--sigma-s", words.sigma_s);
  if (!words.sigma_a.empty()) settings.sigma_a = colour("--sigma-a", words.sigma_a);
  if (words.sigma_t.empty() != words.albedo.empty()) throw UsageError("--sigma-t and --albedo go together");
  if (!words.sigma_t.empty()) {
    if (settings.sigma_s || settings.sigma_a)
      throw UsageError("--sigma-t and --albedo exclude --sigma-s and --sigma-a: choose one pair");
    const Vec3d sigma_t = colour("--sigma-t", words.sigma_t), albedo = colour("--albedo", words.albedo);
    for (int c = 0; c < 3; ++c)
      if (albedo[c] > 1) throw UsageError("--albedo: a value is above 1");
    settings.sigma_s = albedo * sigma_t;
    settings.sigma_a = (Vec3d(1) - albedo) * sigma_t;
  }
  if (!words.g.empty()) {
    settings.g = number("--g", words.g);
    if (!(std::abs(*settings.g) < 1)) throw UsageError("--g: a value between -1 and 1 is needed");
  }
  if (words.light != "both" && words.light != "diffuse" && words.light != "direct")
    throw UsageError("--light: '" + words.light + "' is none of both, diffuse, direct");
  settings.diffuse = words.light != "direct";
  settings.direct = words.light != "diffuse";
  return settings;
}

enum class Format { kExr, kPng };

Format formatOf(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".exr") return Format::kExr;
  if (extension == ".png") return Format::kPng;
  throw UsageError("-o: '" + path + "' ends neither in .exr nor in .png");
}

std::string text(const Vec3d& v) {
  std::ostringstream stream;
  stream << v[0] << ',' << v[1] << ',' << v[2];
  return stream.str();
}

void writePicture(const Words& words, Format format, const Picture& picture, const Optics& optics) {
  // EXR files are for compositing and PNG files to be looked at, hence the different backgrounds.
  const std::string background = !words.background.empty() ? words.background
                                 : format == Format::kExr  ? "none"
                                                           : "0";
  const bool transparent = background == "none";
  const Image image = transparent ? picture.radiance : over(picture, colour("--background", background));
  const std::vector<float> alpha =
      transparent ? opacity(picture) : std::vector<float>(image.pixels.size(), 1);
  std::ostringstream note;
  if (format == Format::kExr) {
    ExrOptions options;
    options.half = words.half;
    options.alpha = &alpha;
    options.attributes = {{"software", std::string("vdb_diffuse ") + VDB_DIFFUSE_VERSION},
                          {"unit", "radiance, in the unit of the lights"},
                          {"sigma_s", text(optics.sigma_s)},
                          {"sigma_a", text(optics.sigma_a)},
                          {"g", std::to_string(optics.g)}};
    writeExr(words.output, image, options);
    note << "radiance as it is";
  } else {
    const bool chosen = !words.exposure.empty();
    const double exposure =
        chosen ? number("--exposure", words.exposure) : automaticExposure(picture.radiance);
    writePng(words.output, image, exposure, transparent ? &alpha : nullptr);
    note << "exposure " << exposure << " stops" << (chosen ? "" : " (chosen; fix it with --exposure)");
  }
  if (!words.quiet) std::cout << words.output << ": " << words.size << ", " << note.str() << "\n";
}

void run(const Words& words) {
  // Everything that can be wrong with the words, before the work.
  const Format format = formatOf(words.output);
  const CameraSettings view = cameraOf(words);
  const LitVolumeSettings medium = mediumOf(words);
  if (!words.exposure.empty()) number("--exposure", words.exposure);
  if (!words.background.empty() && words.background != "none") colour("--background", words.background);
  if (words.samples < 1 || words.samples > 64) throw UsageError("--samples: 1 to 64 are possible");
  if (words.threads < 0) throw UsageError("--threads: a positive number is needed");
  std::error_code ignored;
  if (std::filesystem::equivalent(words.input, words.output, ignored))
    throw UsageError("-o: '" + words.output + "' is the input file");
  std::unique_ptr<tbb::global_control> limit;
  if (words.threads > 0)
    limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, words.threads);

  std::vector<std::string> warnings;
  const LitVolume lit = readLitVolume(words.input, medium, warnings);
  for (const std::string& warning : warnings) std::cerr << "vdb_diffuse: warning: " << warning << "\n";
  RenderSettings settings;
  settings.samples = words.samples;
  settings.interpolate = !words.constant_voxels;
  const Picture picture = render(lit, Camera(view, outline(lit.medium.density)), settings);
  writePicture(words, format, picture, lit.medium.optics);
}

}  // namespace

void addRender(CLI::App& program, ExitStatus&) {
  CLI::App* command = program.add_subcommand("render", "A look at a lit volume: EXR or PNG");
  const auto words = std::make_shared<Words>();
  command->add_option("LIT.vdb", words->input, "Output of 'vdb_diffuse bake'")->required();
  command->add_option("-o,--output", words->output, "Picture; .exr (radiance, RGBA) or .png (sRGB)")
      ->required();
  const std::string view = "View", look = "Picture", medium = "Medium (default: as it was baked)";
  const auto add = [&](const std::string& group, const std::string& flag, std::string& word,
                       const std::string& type, const std::string& help) {
    command->add_option(flag, word, help)->type_name(type)->group(group);
  };
  add(view, "--from", words->from, "X,Y,Z",
      "Position of the camera; default: from where the whole volume is in view");
  add(view, "--look-at", words->look_at, "X,Y,Z",
      "Point in the middle of the picture; default: the volume's middle");
  add(view, "--fov", words->fov, "DEGREES",
      "Angle across the picture's width; default: 35, or with --from what takes in the volume");
  add(view, "--ortho", words->ortho, "WIDTH", "Orthographic, this wide in world units");
  add(view, "--up", words->up, "y|z", "Axis that points up in the picture; default z");
  add(look, "--size", words->size, "WxH", "Pixels; default 960x540");
  add(look, "--exposure", words->exposure, "STOPS",
      "PNG only; default: the 99th percentile of the luminance becomes 0.8 of white");
  add(look, "--background", words->background, "r,g,b|none",
      "Radiance behind the volume, or none for a transparent picture; default: 0 for PNG, none for EXR");
  add(look, "--light", words->light, "both|diffuse|direct", "Which light to show; default both");
  command->add_option("--samples", words->samples, "Rays per pixel each way, 1 to 64; default 2, so 4 in all")
      ->group(look);
  command
      ->add_flag("--constant-voxels", words->constant_voxels,
                 "Show voxels as they are, without interpolation")
      ->group(look);
  command->add_flag("--half", words->half, "EXR with 16-bit pixels")->group(look);
  add(medium, "--density", words->density, "NAME", "Grid of the density");
  add(medium, "--sigma-s", words->sigma_s, "r,g,b", "Scattering per unit density, or one number");
  add(medium, "--sigma-a", words->sigma_a, "r,g,b", "Absorption per unit density, or one number");
  add(medium, "--sigma-t", words->sigma_t, "r,g,b", "Extinction per unit density, with --albedo");
  add(medium, "--albedo", words->albedo, "r,g,b", "Scattering over extinction, with --sigma-t");
  add(medium, "--g", words->g, "V", "Mean scattering cosine; other than 0 it wants the flux grid");
  add(medium, "--emission", words->emission, "NAME", "Grid of the volume's own radiance");
  add(medium, "--emission-scale", words->emission_scale, "V", "Factor on it");
  command->add_option("--threads", words->threads, "At most this many; default all");
  command->add_flag("--quiet", words->quiet, "Only errors and warnings");
  command->footer(
      "Example:\n"
      "  vdb_diffuse bake cloud.vdb -o lit.vdb --sun 1,0.5,-1\n"
      "  vdb_diffuse render lit.vdb -o lit.png --size 1280x720 --from 300,-400,150 --exposure 1");
  command->callback([words] { run(*words); });
}

}  // namespace vdb_diffuse
