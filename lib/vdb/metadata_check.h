#pragma once

#include "vdb/byte_reader.h"

namespace vdb_diffuse {

/// What metadata say that changes how the rest of the grid is read.
struct StoredMetadata {
  bool half = false;  ///< `is_saved_as_half_float`
};

/// Steps over a list of metadata. A value of a type that OpenVDB knows must have that type's size, as OpenVDB
/// reads by the type and not by the size stored. The sizes kept for delayed loading are not used here, but
/// OpenVDB unpacks them whether it will use them or not, so they must be sound.
StoredMetadata checkMetadata(ByteReader& in);

/// Steps over a transform: a map's name, then its numbers.
void checkTransform(ByteReader& in);

}  // namespace vdb_diffuse
