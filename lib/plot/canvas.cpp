#include "plot/canvas.h"

#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "grid/error.h"
#include "plot/markup.h"

namespace vdb_diffuse {
namespace {

constexpr double kCapitalHeight = 0.73;  // of the font's size, in the usual sans-serif fonts
constexpr double kHalo = 0.28;           // width of the white edge, of the font's size

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

/// Cairo numbers its surfaces through the process: without the numbers, the same chart is the same bytes.
void dropSurfaceNumbers(std::string& svg) {
  const std::string word = "surface";
  for (size_t at = svg.find(word); at != std::string::npos; at = svg.find(word, at)) {
    at += word.size();
    svg.erase(at, svg.find_first_not_of("0123456789", at) - at);
  }
}

/// Cairo refuses what is not UTF-8, as a file's name may be: other bytes become question marks.
std::string validUtf8(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size();) {
    const unsigned char lead = static_cast<unsigned char>(text[i]);
    const size_t length = lead < 0x80                   ? 1
                          : lead >= 0xC2 && lead < 0xE0 ? 2
                          : lead >= 0xE0 && lead < 0xF0 ? 3
                                                        : 0;
    bool good = length > 0 && i + length <= text.size();
    for (size_t k = 1; good && k < length; ++k)
      good = (static_cast<unsigned char>(text[i + k]) & 0xC0) == 0x80;
    const unsigned char second = good && length == 3 ? static_cast<unsigned char>(text[i + 1]) : 0;
    if (lead == 0xE0 && good) good = second >= 0xA0;
    if (lead == 0xED && good) good = second < 0xA0;  // halves of surrogate pairs
    out += good ? text.substr(i, length) : "?";
    i += good ? length : 1;
  }
  return out;
}

}  // namespace

PictureFormat pictureFormatOf(const std::string& path) {
  const size_t dot = path.rfind('.');
  std::string extension = dot == std::string::npos ? "" : path.substr(dot);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".svg") return PictureFormat::kSvg;
  if (extension == ".png") return PictureFormat::kPng;
  throw UsageError(path + ": ends neither in .svg nor in .png");
}

struct Canvas::Impl {
  PictureFormat format;
  std::string bytes;
  std::vector<std::string> texts;
  cairo_surface_t* surface = nullptr;
  cairo_t* cairo = nullptr;

  ~Impl() {
    cairo_destroy(cairo);
    cairo_surface_destroy(surface);
  }
  void set(const Colour& c) { cairo_set_source_rgba(cairo, c.red, c.green, c.blue, c.alpha); }
  void trace(const std::vector<Point>& points) {
    cairo_new_path(cairo);
    for (const Point& p : points) cairo_line_to(cairo, p.x, p.y);
  }
  void setFont(const TextStyle& style) {
    cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, style.size);
  }
  void check() {
    for (const cairo_status_t status : {cairo_status(cairo), cairo_surface_status(surface)})
      if (status != CAIRO_STATUS_SUCCESS)
        throw OutputError(std::string("the picture could not be drawn: ") + cairo_status_to_string(status));
  }
};

Canvas::Canvas(PictureFormat format, int width, int height) : impl_(std::make_unique<Impl>()) {
  impl_->format = format;
  impl_->surface = format == PictureFormat::kSvg
                       ? cairo_svg_surface_create_for_stream(append, &impl_->bytes, width, height)
                       : cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
  if (format == PictureFormat::kSvg) cairo_svg_surface_set_document_unit(impl_->surface, CAIRO_SVG_UNIT_PX);
  impl_->cairo = cairo_create(impl_->surface);
  impl_->check();
  cairo_t* cairo = impl_->cairo;
  // Letters keep their true widths, so that both formats are laid out alike.
  cairo_font_options_t* options = cairo_font_options_create();
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_set_font_options(cairo, options);
  cairo_font_options_destroy(options);
  cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
  impl_->set({1, 1, 1});
  cairo_paint(cairo);
}

Canvas::~Canvas() = default;

void Canvas::line(const std::vector<Point>& points, const Pen& pen) {
  cairo_t* cairo = impl_->cairo;
  impl_->trace(points);
  impl_->set(pen.colour);
  cairo_set_line_width(cairo, pen.width);
  const double dashes[] = {5 * pen.width, 3.5 * pen.width};
  cairo_set_dash(cairo, dashes, pen.dashed ? 2 : 0, 0);
  cairo_stroke(cairo);
}

void Canvas::area(const std::vector<Point>& corners, const Colour& colour) {
  impl_->trace(corners);
  cairo_close_path(impl_->cairo);
  impl_->set(colour);
  cairo_fill(impl_->cairo);
}

void Canvas::disc(const Point& centre, double radius, const Colour& colour) {
  cairo_new_path(impl_->cairo);
  cairo_arc(impl_->cairo, centre.x, centre.y, radius, 0, 2 * M_PI);
  impl_->set(colour);
  cairo_fill(impl_->cairo);
}

double Canvas::textWidth(const std::string& utf8, const TextStyle& style) const {
  impl_->setFont(style);
  cairo_text_extents_t extents;
  cairo_text_extents(impl_->cairo, validUtf8(utf8).c_str(), &extents);
  return extents.x_advance;
}

void Canvas::text(const std::string& utf8, const Point& at, const TextStyle& style) {
  if (utf8.empty()) return;
  const std::string text = validUtf8(utf8);
  impl_->texts.push_back(text);
  cairo_t* cairo = impl_->cairo;
  const double width = textWidth(utf8, style);
  cairo_save(cairo);
  cairo_translate(cairo, at.x, at.y);
  if (style.upwards) cairo_rotate(cairo, -M_PI / 2);
  const double left = style.x == AlignX::kLeft ? 0 : style.x == AlignX::kMiddle ? -width / 2 : -width;
  const double down = style.y == AlignY::kMiddle ? kCapitalHeight * style.size / 2 : 0;
  impl_->setFont(style);
  if (style.halo) {
    cairo_new_path(cairo);
    cairo_move_to(cairo, left, down);
    cairo_text_path(cairo, text.c_str());
    impl_->set({1, 1, 1, 0.85});
    cairo_set_line_width(cairo, kHalo * style.size);
    cairo_set_dash(cairo, nullptr, 0, 0);
    cairo_stroke(cairo);
  }
  cairo_move_to(cairo, left, down);
  impl_->set(style.colour);
  cairo_show_text(cairo, text.c_str());
  cairo_new_path(cairo);
  cairo_restore(cairo);
}

void Canvas::pixels(const Box& box, int width, int height, const std::vector<Colour>& colours) {
  cairo_surface_t* picture = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
  const int stride = cairo_image_surface_get_stride(picture);
  unsigned char* rows = cairo_image_surface_get_data(picture);
  const auto byte = [](double v) { return static_cast<uint32_t>(std::clamp(v, 0.0, 1.0) * 255 + 0.5); };
  for (int y = 0; rows && y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Colour& c = colours[static_cast<size_t>(y) * width + x];
      const uint32_t word = byte(c.red) << 16 | byte(c.green) << 8 | byte(c.blue);
      std::memcpy(rows + static_cast<size_t>(y) * stride + 4 * static_cast<size_t>(x), &word, sizeof word);
    }
  cairo_surface_mark_dirty(picture);
  cairo_t* cairo = impl_->cairo;
  cairo_save(cairo);
  cairo_translate(cairo, box.left, box.top);
  cairo_scale(cairo, box.width / width, box.height / height);
  cairo_set_source_surface(cairo, picture, 0, 0);
  cairo_pattern_set_filter(cairo_get_source(cairo), CAIRO_FILTER_NEAREST);
  cairo_paint(cairo);
  cairo_restore(cairo);
  cairo_surface_destroy(picture);
  impl_->check();
}

void Canvas::clip(const Box& box) {
  cairo_save(impl_->cairo);
  cairo_rectangle(impl_->cairo, box.left, box.top, box.width, box.height);
  cairo_clip(impl_->cairo);
}

void Canvas::unclip() {
  cairo_restore(impl_->cairo);
}

std::string Canvas::finish() {
  impl_->check();
  if (impl_->format == PictureFormat::kPng)
    cairo_surface_write_to_png_stream(impl_->surface, append, &impl_->bytes);
  cairo_surface_finish(impl_->surface);
  if (cairo_surface_status(impl_->surface) != CAIRO_STATUS_SUCCESS || impl_->bytes.empty())
    throw OutputError("the picture could not be encoded");
  if (impl_->format == PictureFormat::kPng) return std::move(impl_->bytes);
  dropSurfaceNumbers(impl_->bytes);
  if (!impl_->texts.empty()) {
    std::string words = "\n<title>" + escapedMarkup(impl_->texts.front()) + "</title>\n<desc>";
    for (size_t i = 1; i < impl_->texts.size(); ++i)
      words += (i > 1 ? "; " : "") + escapedMarkup(impl_->texts[i]);
    const size_t root = impl_->bytes.find("<svg");
    impl_->bytes.insert(impl_->bytes.find('>', root) + 1, words + "</desc>");
  }
  return std::move(impl_->bytes);
}

}  // namespace vdb_diffuse
