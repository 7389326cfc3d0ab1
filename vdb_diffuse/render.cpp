#include "render/render.h"

#include <tbb/global_control.h>

#include <cstdio>
#include <iostream>
#include <memory>
#include <sstream>

#include "commands.h"
#include "example.h"
#include "interrupt.h"
#include "io/atomic_file.h"
#include "io/image.h"
#include "io/json_file.h"
#include "io/whole_file.h"
#include "light_layers.h"
#include "lit_volume.h"
#include "progress_bar.h"
#include "render/turntable.h"
#include "render_slice.h"
#include "scene_options.h"
#include "sequence/frame_name.h"
#include "words.h"

namespace vdb_diffuse {
namespace {

enum class Format { kExr, kPng };

struct RenderFlags {
  std::string input, output, size = "960x540", light = "both";
  std::optional<std::string> from, look_at, fov, ortho, exposure, background;
  int samples = 2, threads = 0, turntable = 0;  // threads 0: all
  bool constant_voxels = false, half = false, clamp = false, sheet = false, layers = false;
  SliceFlags slice;
  SceneOptions scene;  // of which the medium, and which way is up
  ProgressFlags progress;
};

/// The flags understood: everything that can be wrong with them is found before the work.
struct RenderJob {
  Format format = Format::kPng;
  CameraSettings view;
  LitVolumeSettings lit;
  RenderSettings settings;
  std::optional<double> exposure;   ///< stops; none: automatic
  std::optional<Vec3d> background;  ///< none: transparent
  bool half = false, sheet = false, layers = false;
};

Format formatOf(const std::string& path) {
  const std::string extension = extensionOf(path);
  if (extension == ".exr") return Format::kExr;
  if (extension == ".png") return Format::kPng;
  refuseWord("-o", path, "ends neither in .exr nor in .png");
}

CameraSettings viewOf(const RenderFlags& flags) {
  constexpr double kDegree = 3.14159265358979323846 / 180;
  constexpr long kMostPixels = 1L << 28;
  CameraSettings view;
  char rest = 0;
  if (std::sscanf(flags.size.c_str(), "%6dx%6d%c", &view.width, &view.height, &rest) != 2 || view.width < 1 ||
      view.height < 1)
    refuseWord("--size", flags.size, "expected WxH, such as 960x540");
  if (static_cast<long>(view.width) * view.height > kMostPixels)
    refuseWord("--size", flags.size, "more than " + std::to_string(kMostPixels) + " pixels");
  if (flags.from) view.from = pointIn("--from", *flags.from);
  if (flags.look_at) view.look_at = pointIn("--look-at", *flags.look_at);
  if (flags.fov) view.fov = numberIn("--fov", *flags.fov) * kDegree;
  if (flags.ortho) view.ortho = numberIn("--ortho", *flags.ortho);
  if (flags.scene.up == "y") view.up = Vec3d(0, 1, 0);
  return view;
}

/// Flags that contradict each other.
void checkModes(const RenderFlags& flags, Format format) {
  if (flags.sheet && format != Format::kPng) refuseWord("--sheet -o", flags.output, "is a .png");
  if (flags.layers && format != Format::kExr) refuseWord("--layers -o", flags.output, "is an .exr");
  if ((flags.sheet || flags.layers) && flags.light != "both")
    refuseWord("--light", flags.light, "leaves out what --sheet and --layers show; leave it out");
  if (flags.turntable > 1 && !hasFrame(flags.output))
    refuseWord("-o", flags.output, "every picture would be written there; put #### in the name");
}

RenderJob jobOf(const RenderFlags& flags) {
  RenderJob job;
  job.format = formatOf(flags.output);
  checkModes(flags, job.format);
  job.lit.medium = flags.scene.resolve().medium;
  job.lit.read.clamp = flags.clamp;
  job.lit.diffuse = flags.light != "direct";
  job.lit.direct = flags.light != "diffuse";
  job.view = viewOf(flags);
  job.settings.samples = flags.samples;
  job.settings.interpolate = !flags.constant_voxels;
  job.half = flags.half;
  job.sheet = flags.sheet;
  job.layers = flags.layers;
  if (flags.exposure) job.exposure = numberIn("--exposure", *flags.exposure);
  // EXR files are for compositing and PNG files to be looked at, hence the different backgrounds.
  const std::string background = flags.background.value_or(job.format == Format::kExr ? "none" : "0");
  if (background != "none") job.background = rgbIn("--background", background);
  if (sameFile(flags.input, flags.output)) refuseWord("-o", flags.output, "is the input file");
  return job;
}

std::string text(const Vec3d& v) {
  std::ostringstream stream;
  stream << v[0] << ',' << v[1] << ',' << v[2];
  return stream.str();
}

std::string exposureNote(const RenderJob& job, double exposure) {
  std::ostringstream note;
  note << "exposure " << exposure << " stops" << (job.exposure ? "" : " (chosen; fix it with --exposure)");
  return note.str();
}

/// Writes the picture; what to say about its brightness. \param layers   null: one picture alone
std::string writePicture(const std::string& path, const RenderJob& job, const Picture& picture,
                         const LightLayers* layers, const Optics& optics) {
  const double exposure = job.exposure.value_or(automaticExposure(picture.radiance));
  if (job.sheet) {
    writeWholeFile(path, contactSheet(*layers, exposure, job.background.value_or(Vec3d(0))));
    return exposureNote(job, exposure);
  }
  const Image image = job.background ? over(picture, *job.background) : picture.radiance;
  const std::vector<float> alpha =
      job.background ? std::vector<float>(image.pixels.size(), 1) : opacity(picture);
  if (job.format == Format::kExr) {
    ExrOptions options;
    options.half = job.half;
    options.alpha = &alpha;
    options.attributes = {{"software", std::string("vdb_diffuse ") + VDB_DIFFUSE_VERSION},
                          {"unit", "radiance, in the unit of the lights"},
                          {"sigma_s", text(optics.sigma_s)},
                          {"sigma_a", text(optics.sigma_a)},
                          {"g", std::to_string(optics.g)}};
    if (layers) options.layers = {{"direct", &layers->direct}, {"diffuse", &layers->diffuse}};
    writeExr(path, image, options);
    return "radiance as it is";
  }
  writePng(path, image, exposure, job.background ? nullptr : &alpha);
  return exposureNote(job, exposure);
}

void renderView(const RenderFlags& flags, const RenderJob& job, const std::string& path, LitVolume& lit,
                const Camera& camera) {
  const Progress progress = makeProgress(flags.progress);
  LightLayers layers;
  const bool layered = job.sheet || job.layers;
  if (layered)
    layers = renderLayers(lit, camera, job.settings, progress);
  else
    layers.both = render(lit, camera, job.settings, progress);
  const std::string note =
      writePicture(path, job, layers.both, layered ? &layers : nullptr, lit.medium.optics);
  if (!flags.progress.quiet) std::cout << path << ": " << flags.size << ", " << note << "\n";
}

/// All pictures under the exposure that is chosen for the first.
void renderTurntable(const RenderFlags& flags, RenderJob job, LitVolume& lit) {
  const std::vector<Vec3d> points = outline(lit.medium.density);
  const std::vector<CameraSettings> views = turntable(job.view, points, flags.turntable);
  if (!job.exposure && job.format == Format::kPng)
    job.exposure = automaticExposure(
        render(lit, Camera(views[0], points), job.settings, makeProgress(flags.progress)).radiance);
  for (size_t n = 0; n < views.size(); ++n) {
    throwIfInterrupted();
    renderView(flags, job, frameName(flags.output, static_cast<int>(n) + 1), lit, Camera(views[n], points));
  }
}

void run(const RenderFlags& flags) {
  if (flags.slice.given()) return renderSlice(flags.slice, flags.input, flags.output, flags.progress);
  flags.slice.refuseAlone();
  const RenderJob job = jobOf(flags);
  std::unique_ptr<tbb::global_control> limit;
  if (flags.threads > 0)
    limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, flags.threads);

  std::vector<std::string> warnings;
  LitVolume lit = readLitVolume(flags.input, job.lit, warnings);
  for (const std::string& warning : warnings) flags.progress.logOf("render").warning(warning);
  if (flags.turntable > 0) return renderTurntable(flags, job, lit);
  renderView(flags, job, flags.output, lit, Camera(job.view, outline(lit.medium.density)));
}

}  // namespace

void addRender(CLI::App& program, ExitStatus&) {
  CLI::App* command = program.add_subcommand("render", "A look at a lit volume: EXR or PNG");
  const auto flags = std::make_shared<RenderFlags>();
  command->add_option("LIT.vdb", flags->input, "Output of 'vdb_diffuse bake'")->required();
  command->add_option("-o,--output", flags->output, "Picture; .exr (radiance, RGBA) or .png (sRGB)")
      ->required();
  const std::string view = "View", look = "Picture";
  addWord(*command, view, "--from", flags->from, "X,Y,Z",
          "Position of the camera (default: from where the whole volume is in view)");
  addWord(*command, view, "--look-at", flags->look_at, "X,Y,Z",
          "Point in the middle of the picture (default: the volume's middle)");
  addWord(*command, view, "--fov", flags->fov, "DEGREES",
          "Angle across the picture's width (default: 35, or with --from what takes in the volume)");
  addWord(*command, view, "--ortho", flags->ortho, "WIDTH", "Orthographic, this wide in world units");
  addWord(*command, view, "--up", flags->scene.up, "y|z", "Axis that points up in the picture (default: z)");
  addWord(*command, look, "--size", flags->size, "WxH", "Pixels (default: 960x540)");
  addWord(*command, look, "--exposure", flags->exposure, "STOPS",
          "PNG only (default: the 99th percentile of the luminance becomes 0.8 of white)");
  addWord(*command, look, "--background", flags->background, "V|none",
          "Radiance behind the volume, or none for a transparent picture (default: 0 for PNG, none for EXR)");
  addWord(*command, look, "--light", flags->light, "both|diffuse|direct",
          "Which light to show (default: both)")
      ->check(CLI::IsMember({"both", "diffuse", "direct"}));
  addWord(*command, look, "--samples", flags->samples, "N",
          "Rays per pixel each way, 1 to 64 (default: 2, so 4 in all)")
      ->check(CLI::Range(1, 64));
  addWord(*command, view, "--turntable", flags->turntable, "N",
          "N pictures, once around the volume; #### in the name of -o stands for 1 to N")
      ->check(CLI::Range(1, 10000));
  command->add_flag("--sheet", flags->sheet, "PNG: direct light, diffuse light and both, side by side")
      ->group(look);
  command
      ->add_flag("--layers", flags->layers,
                 "EXR: also channels direct.R, .G, .B and diffuse.R, .G, .B, which add up to R, G, B")
      ->group(look);
  flags->slice.addTo(*command);
  command
      ->add_flag("--constant-voxels", flags->constant_voxels,
                 "Show voxels as they are, without interpolation")
      ->group(look);
  command->add_flag("--half", flags->half, "EXR with 16-bit pixels")->group(look);
  flags->scene.addMediumTo(*command, MediumDefaults::kAsBaked);
  command->add_flag("--clamp", flags->clamp,
                    "Values that are not finite, or negative densities, count as 0 instead of being refused");
  command->add_option("--threads", flags->threads, "At most this many (default: all)")
      ->check(CLI::PositiveNumber);
  addProgressFlags(command, flags->progress);
  setExample(command,
             "vdb_diffuse bake cloud.vdb -o lit.vdb --sun 1,0.5,-1\n"
             "vdb_diffuse render lit.vdb -o lit.png --size 1280x720 --exposure 1\n"
             "vdb_diffuse render lit.vdb -o 'turn.####.png' --turntable 48\n"
             "vdb_diffuse render lit.vdb -o slice.png --slice z:2.5 --grid diffuse --range 0,0.5");
  command->callback([flags] { run(*flags); });
}

}  // namespace vdb_diffuse
