#pragma once

#include <memory>
#include <string>
#include <vector>

namespace vdb_diffuse {

/// A sheet to draw on, as a file in memory: SVG or PNG from the same calls. One unit is one pixel of the PNG;
/// x runs to the right and y down. Cairo draws; its types stay in canvas.cpp.

struct Point {
  double x = 0, y = 0;
};

struct Box {
  double left = 0, top = 0, width = 0, height = 0;
  double right() const { return left + width; }
  double bottom() const { return top + height; }
  bool holds(const Box& b) const {
    return b.left >= left && b.right() <= right() && b.top >= top && b.bottom() <= bottom();
  }
};

/// sRGB and opacity, 0 to 1.
struct Colour {
  double red = 0, green = 0, blue = 0, alpha = 1;
  Colour withAlpha(double a) const { return {red, green, blue, a}; }
};

enum class PictureFormat { kSvg, kPng };

/// By the ending of a path; UsageError for another than .svg and .png.
PictureFormat pictureFormatOf(const std::string& path);

struct Pen {
  Colour colour;
  double width = 1;
  bool dashed = false;
};

enum class AlignX { kLeft, kMiddle, kRight };
enum class AlignY { kBaseline, kMiddle };

struct TextStyle {
  double size = 16;  ///< of the font, units
  Colour colour;
  bool bold = false;
  AlignX x = AlignX::kLeft;
  AlignY y = AlignY::kBaseline;  ///< kMiddle: the middle of a capital's height
  bool upwards = false;          ///< turned to run from bottom to top
  bool halo = false;             ///< a white edge, so that it reads over lines
};

class Canvas {
 public:
  /// White. \throws OutputError where a sheet of this size cannot be had
  Canvas(PictureFormat format, int width, int height);
  ~Canvas();

  void line(const std::vector<Point>& points, const Pen& pen);
  void area(const std::vector<Point>& corners, const Colour& colour);
  void disc(const Point& centre, double radius, const Colour& colour);
  void text(const std::string& utf8, const Point& at, const TextStyle& style);
  double textWidth(const std::string& utf8, const TextStyle& style) const;
  /// A picture of width x height rectangles, row after row from the upper left, that fills the box; opaque,
  /// and with sharp edges where it is enlarged. An SVG holds it as a picture.
  void pixels(const Box& box, int width, int height, const std::vector<Colour>& colours);
  /// Until `unclip`, nothing is drawn outside the box.
  void clip(const Box& box);
  void unclip();

  /// The file's bytes. Letters are outlines, the same on every machine; an SVG also carries the first text
  /// drawn as its <title> and the others as its <desc>, for searching and for reading aloud. To be called
  /// once, at the end.
  std::string finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vdb_diffuse
