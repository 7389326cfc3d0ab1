#include "render_slice.h"

#include <openvdb/Grid.h>

#include <filesystem>
#include <iostream>

#include "check/slice_picture.h"
#include "grid/error.h"
#include "io/atomic_file.h"
#include "io/json_file.h"
#include "io/vdb_reader.h"
#include "io/whole_file.h"
#include "words.h"

namespace vdb_diffuse {
namespace {

SliceSettings settingsOf(const SliceFlags& flags) {
  SliceSettings settings;
  const std::string& text = *flags.slice;
  settings.axis = text.empty() ? -1 : static_cast<int>(std::string("xyz").find(text[0]));
  if (settings.axis < 0 || settings.axis > 2 || (text.size() > 1 && text[1] != ':'))
    refuseWord("--slice", text, "expected x, y or z, or with a place, such as z:2.5");
  if (text.size() > 1) {
    const auto place = numbersIn(text.substr(2));
    if (!place || place->size() != 1) refuseWord("--slice", text, "expected one number behind the colon");
    settings.at = place->front();
  }
  if (flags.range) {
    const auto ends = numbersIn(*flags.range);
    if (!ends || ends->size() != 2 || !((*ends)[0] < (*ends)[1]))
      refuseWord("--range", *flags.range, "expected two numbers, the lower first");
    settings.low = (*ends)[0];
    settings.high = (*ends)[1];
  }
  return settings;
}

std::string unitOf(const openvdb::GridBase& grid) {
  const auto unit = grid.getMetadata<openvdb::StringMetadata>("unit");
  return unit ? unit->value() : "";
}

/// Of vectors the length is shown, of colours the luminance.
bool isColour(const std::string& grid) {
  return grid == "diffuse" || grid == "direct" || grid == "source" || grid == "diffuse_se";
}

}  // namespace

void SliceFlags::addTo(CLI::App& command) {
  const std::string group = "Slice (a picture of numbers instead of a view)";
  addWord(command, group, "--slice", slice, "x|y|z[:W]",
          "One layer of voxels across this axis, at W in world units (default: the middle), as a .png");
  addWord(command, group, "--grid", grid, "NAME", "Which grid to show (default: diffuse)");
  addWord(command, group, "--range", range, "A,B",
          "Values at the ends of the colour scale (default: 0 and the largest in the slice)");
}

void SliceFlags::refuseAlone() const {
  if (grid) refuseWord("--grid", *grid, "needs --slice");
  if (range) refuseWord("--range", *range, "needs --slice");
}

void renderSlice(const SliceFlags& flags, const std::string& input, const std::string& output,
                 const ProgressFlags& progress) {
  SliceSettings settings = settingsOf(flags);
  if (extensionOf(output) != ".png") refuseWord("-o", output, "a slice is written as a .png");
  if (sameFile(input, output)) refuseWord("-o", output, "is the input file");
  const std::string name = flags.grid.value_or("diffuse");
  const VdbFile file(input);
  file.require(name, "choose another with --grid");
  const GridValues values = file.readValues(name);
  settings.length = values.channels.size() == 3 && !isColour(name);
  settings.unit = unitOf(*file.readGrid(name));
  settings.title = std::filesystem::path(input).filename().string() + ": " + name +
                   (values.channels.size() == 1 ? ""
                    : settings.length           ? ", length"
                                                : ", luminance");
  try {
    writeWholeFile(output, slicePicture(values, settings));
  } catch (const InputError& error) {
    throw InputError(input + ": grid " + name + ": " + error.what());
  }
  if (!progress.quiet) std::cout << output << ": a slice of " << name << "\n";
}

}  // namespace vdb_diffuse
