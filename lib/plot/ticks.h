#pragma once

#include <string>
#include <vector>

namespace vdb_diffuse {

enum class Scale { kLinear, kLog };

/// A mark on an axis; minor ones carry no label.
struct Tick {
  double value = 0;
  std::string label;
};

/// Ticks at round numbers in [low, high], ascending. Linear: multiples of 1, 2 or 5 times a power of ten.
/// Logarithmic: powers of ten, with other digits between them where there is room, and unlabelled ticks at
/// the rest. Where a logarithmic axis is so short that it holds fewer
/// than two of these, they are the linear ones.
/// \param most  so many labels fit, >= 2
std::vector<Tick> ticksOf(Scale scale, double low, double high, int most);

/// 0.05, 2, 1500, 10⁻⁷: as short as it can be told from its neighbours, `step` apart.
std::string tickLabel(double value, double step);

}  // namespace vdb_diffuse
