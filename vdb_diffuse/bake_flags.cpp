#include <cmath>

#include "bake.h"
#include "blobs/blob_light.h"
#include "transport/illuminate.h"

namespace vdb_diffuse {
namespace {

constexpr int kMostSweeps = 16;  // of a bake that sweeps until its error is small enough

/// Flags of the one method that mean nothing to the other.
void checkMethod(const BakeFlags& flags) {
  const auto refuse = [&](bool given, const std::string& flag, const std::string& why) {
    if (given) throw UsageError(flag + ": has no meaning with --method " + flags.method + why);
  };
  if (!flags.byBlobs()) {
    for (const auto& [given, flag] : {std::pair(flags.blobs.has_value(), "--blobs"),
                                      std::pair(flags.blob_form.has_value(), "--blob-form"),
                                      std::pair(flags.blob_source.has_value(), "--blob-source")})
      refuse(given, flag, "; add --method blobs");
    return;
  }
  refuse(flags.sweeps.value_or(0) > 0, "--sweeps", ", whose light is too coarse to sweep from; leave it out");
  refuse(flags.light_groups, "--light-groups", "; leave it out");
  refuse(flags.error.has_value(), "--error", ", which cannot reach an error by itself; leave it out");
  if (flags.blob_form.value_or("") == "collocation" && flags.blobs.value_or(0) > kMostCollocated)
    throw UsageError("--blob-form collocation: takes at most " + std::to_string(kMostCollocated) +
                     " blobs; use galerkin for more");
}

}  // namespace

ModelSettings modelOf(const BakeFlags& flags) {
  ModelSettings settings;
  settings.model = flags.model == "p1"      ? Model::kP1
                   : flags.model == "paper" ? Model::kPaper
                                            : Model::kDefault;
  if (flags.cap == "none") settings.mean_free_path_cap = std::numeric_limits<double>::infinity();
  if (flags.cap == "none" || flags.cap == "auto") return settings;
  char* end = nullptr;
  const double length = std::strtod(flags.cap.c_str(), &end);
  if (*end != '\0' || !(length > 0) || !std::isfinite(length))
    throw UsageError("--mean-free-path-cap: '" + flags.cap + "' is not auto, none or a length above 0");
  settings.mean_free_path_cap = length;
  return settings;
}

int sweepsOf(const BakeFlags& flags) {
  if (flags.byBlobs()) return 0;
  return flags.sweeps.value_or(flags.error                               ? kMostSweeps
                               : modelOf(flags).model == Model::kDefault ? TransportSettings().sweeps
                                                                         : 0);
}

void checkFlags(const BakeFlags& flags) {
  const ModelSettings model = modelOf(flags);
  if (!(flags.tolerance > 0 && flags.tolerance < 1))
    throw UsageError("--tolerance: a number between 0 and 1 is needed");
  if (flags.error && !(*flags.error > 0 && *flags.error < 1))
    throw UsageError("--error: a number between 0 and 1 is needed; 0.05 is 5 %");
  checkMethod(flags);
  if (model.model == Model::kPaper && (flags.sweeps.value_or(0) > 0 || flags.error))
    throw UsageError(
        "--model paper: the printed equations lose energy, and no sweep can start from them; use "
        "--model default or p1");
}

void BakeFlags::addMethodTo(CLI::App& command) {
  const std::string group = "Method";
  command
      .add_option("--method", method,
                  "multigrid: a value in every voxel; blobs: a few hundred Gaussians, a preview")
      ->check(CLI::IsMember({"multigrid", "blobs"}))
      ->group(group)
      ->capture_default_str();
  command.add_option("--blobs", blobs, "How many blobs are fitted to the density (default: 200)")
      ->type_name("N")
      ->check(CLI::Range(1, kMostBlobs))
      ->group(group);
  command
      .add_option("--blob-form", blob_form,
                  "galerkin: the equation in the mean over each blob; collocation: at their centres, as "
                  "Stam (1995) has it (default: galerkin)")
      ->check(CLI::IsMember({"galerkin", "collocation"}))
      ->group(group);
  command
      .add_option("--blob-source", blob_source,
                  "Where the blobs look for light: in all voxels, or at their centres, as the paper has it, "
                  "which is far quicker unless `direct` is written too (default: voxels)")
      ->check(CLI::IsMember({"voxels", "centres"}))
      ->group(group);
  command
      .add_option("--model", model,
                  "default: P1 with returned light, staircase area factor, mean-free-path cap and "
                  "delta-Eddington; p1: none of "
                  "them; paper: as Stam (1995) prints it")
      ->check(CLI::IsMember({"default", "p1", "paper"}))
      ->group(group)
      ->capture_default_str();
  command
      .add_option(
          "--mean-free-path-cap", cap,
          "Longest path that light takes between scatterings, world units; auto: 0.5 times the cube root of "
          "the active volume with the default model, else none")
      ->type_name("L|auto|none")
      ->group(group)
      ->capture_default_str();
  command
      .add_option("--sweeps", sweeps,
                  "Transport sweeps after the diffusion solve: each buys a smaller error for more time; 0 is "
                  "diffusion alone (default: 2; with --error at most 16; 0 for other models)")
      ->type_name("K")
      ->check(CLI::Range(0, 100))
      ->group(group);
  command
      .add_option("--error", error,
                  "Sweep until the estimated error is at most this: 0.05 is 5 %, RMS on blocks of 4^3 voxels")
      ->type_name("V")
      ->group(group);
  command.add_option("--tolerance", tolerance, "Of the solve, on the scaled residual")
      ->group(group)
      ->capture_default_str();
  command
      .add_option("--coarsen", coarsen,
                  "Solve in voxels of 2^N times the width, 0 to 4; auto: the finest that memory holds")
      ->type_name("N|auto")
      ->check(CLI::IsMember({"0", "1", "2", "3", "4", "auto"}))
      ->group(group)
      ->capture_default_str();
  command
      .add_flag(
          "--light-groups", light_groups,
          "Write diffuse_NAME and direct_NAME too, for every light or `group` of lights of the scene file")
      ->group("Output");
  command
      .add_flag("--exact-shadows", exact_shadows,
                "March from every voxel to every light, slowly, instead of sweeping along each direction")
      ->group(group);
}

}  // namespace vdb_diffuse
