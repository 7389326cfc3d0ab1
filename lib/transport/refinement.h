#pragma once

#include "diffusion/diffuse.h"

namespace vdb_diffuse {

struct TransportSettings {
  int sweeps = 2;  ///< after the diffusion solve, each followed by a correction
  std::optional<double>
      error;                  ///< sweep until the estimated error is at most this; `sweeps` is then the most
  int directions = 96;        ///< of a sweep, see halfRangeSet
  int fine_directions = 168;  ///< of later sweeps, and of all where surfaces reflect
  int coarse_sweeps = 2;      ///< with the fewer: what is left after them is theirs
};

/// What makes the sweeps of illuminate.h, to be given to a diffusion solve as `refine`. Keeps what serves
/// several channels.
/// \param medium   outlives it
std::function<void(ChannelSolution&)> transportRefinement(const Medium& medium,
                                                          const DiffuseSettings& settings,
                                                          const TransportSettings& transport);

}  // namespace vdb_diffuse
