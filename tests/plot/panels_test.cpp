#include "plot/panels.h"

#include <gtest/gtest.h>

#include "grid/error.h"

namespace vdb_diffuse {
namespace {

PanelSheet sheetOfTwo() {
  PanelSheet sheet;
  sheet.title = "Two panels";
  sheet.rows = {{Panel{"left", 2, 2, {0, 0.5, 1, 2}}, Panel{"right", 2, 2, {0, 0, 0, 0}}}};
  sheet.scale_label = "share";
  sheet.cell_width = sheet.cell_height = 40;
  return sheet;
}

TEST(Panels, SayTheirWordsAndHoldTheirPictures) {
  const std::string svg = drawPanels(sheetOfTwo(), PictureFormat::kSvg);
  for (const char* words : {"Two panels", "left", "right", "share"})
    EXPECT_NE(svg.find(words), std::string::npos) << words;
  size_t pictures = 0;  // two, and the scale
  for (size_t at = svg.find("<image"); at != std::string::npos; at = svg.find("<image", at + 1)) ++pictures;
  EXPECT_EQ(pictures, 3u);
  EXPECT_EQ(drawPanels(sheetOfTwo(), PictureFormat::kPng).substr(1, 3), "PNG");
}

TEST(Panels, ListsOfWrongLengthsAreRefused) {
  PanelSheet sheet = sheetOfTwo();
  sheet.rows[0][1].values.pop_back();
  EXPECT_THROW(drawPanels(sheet, PictureFormat::kPng), InputError);
  sheet = sheetOfTwo();
  sheet.rows[0][0].columns = {"one"};
  EXPECT_THROW(drawPanels(sheet, PictureFormat::kPng), InputError);
}

}  // namespace
}  // namespace vdb_diffuse
