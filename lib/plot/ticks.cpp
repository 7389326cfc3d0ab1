#include "plot/ticks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace vdb_diffuse {
namespace {

constexpr double kSlack = 1e-9;  // of a step: a tick on the axis' end counts, whatever the rounding

std::string superscript(int n) {
  static const char* const kDigits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out = n < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(n))) out += kDigits[c - '0'];
  return out;
}

std::vector<Tick> linearTicks(double low, double high, int most) {
  const double rough = (high - low) / most;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = power;
  for (const double digit : {1.0, 2.0, 5.0, 10.0}) {
    step = digit * power;
    if (std::floor(high / step + kSlack) - std::ceil(low / step - kSlack) + 1 <= most) break;
  }
  std::vector<Tick> ticks;
  for (double n = std::ceil(low / step - kSlack); n <= high / step + kSlack; ++n)
    ticks.push_back({n * step, tickLabel(n * step, step)});
  return ticks;
}

/// Every tick at a digit times a power of ten, with labels at those digits (of every `stride`th power).
std::vector<Tick> logTicks(double low, double high, const std::vector<int>& digits, int stride) {
  std::vector<Tick> ticks;
  const int first = static_cast<int>(std::floor(std::log10(low))),
            last = static_cast<int>(std::floor(std::log10(high)));
  for (int power = first; power <= last; ++power)
    for (int digit = 1; digit <= 9; ++digit) {
      const double value = digit * std::pow(10.0, power);
      if (value < low * (1 - kSlack) || value > high * (1 + kSlack)) continue;
      const bool named =
          std::find(digits.begin(), digits.end(), digit) != digits.end() && power % stride == 0;
      if (named || stride == 1 || digit == 1) ticks.push_back({value, named ? tickLabel(value, value) : ""});
    }
  return ticks;
}

std::vector<double> labelled(const std::vector<Tick>& ticks) {
  std::vector<double> values;
  for (const Tick& tick : ticks)
    if (!tick.label.empty()) values.push_back(tick.value);
  return values;
}

/// Labels on a logarithmic axis crowd where digits are high: no two may be nearer than this part of their
/// fair share.
bool fit(const std::vector<double>& values, double low, double high, int most) {
  constexpr double kShare = 0.7;
  for (size_t i = 1; i < values.size(); ++i)
    if (std::log(values[i] / values[i - 1]) < kShare * std::log(high / low) / most) return false;
  return static_cast<int>(values.size()) <= most;
}

}  // namespace

std::string tickLabel(double value, double step) {
  const double size = std::abs(value);
  if (size < 1e-9 * step) return "0";
  const int power = static_cast<int>(std::floor(std::log10(size) + kSlack));
  if (size >= 1e6 || size < 1e-4) {
    const int digits = std::max(0, power - static_cast<int>(std::floor(std::log10(step) + kSlack)));
    char mantissa[32];
    std::snprintf(mantissa, sizeof mantissa, "%.*f", digits, value / std::pow(10.0, power));
    const std::string ten = "10" + superscript(power);
    return mantissa == std::string("1") ? ten : std::string(mantissa) + "·" + ten;
  }
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + kSlack)));
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

std::vector<Tick> ticksOf(Scale scale, double low, double high, int most) {
  if (scale == Scale::kLinear) return linearTicks(low, high, most);
  for (const auto& digits :
       {std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8, 9}, {1, 2, 3, 5}, {1, 2, 5}, {1, 3}, {1}}) {
    std::vector<Tick> ticks = logTicks(low, high, digits, 1);
    const std::vector<double> values = labelled(ticks);
    if (values.size() < 2) return linearTicks(low, high, most);
    if (fit(values, low, high, most)) return ticks;
  }
  int stride = 2;
  while (!fit(labelled(logTicks(low, high, {1}, stride)), low, high, most)) ++stride;
  return logTicks(low, high, {1}, stride);
}

}  // namespace vdb_diffuse
