#pragma once

#include <string>
#include <vector>

#include "report/measurement.h"

namespace vdb_diffuse {

/// The measurements as comma-separated values under one line of names. Errors, bias and the like are
/// fractions; what does not apply to a row is empty. Where `block` is neither 1 nor 4, a column
/// `rel_rms_blocksN` has the errors on such blocks.
std::string reportCsv(const std::vector<Measurement>& rows, int block, int threads);

/// The same for the eye, in percent.
std::string reportTable(const std::vector<Measurement>& rows, int block);

/// "default reaches 12.3 % in 0.8 s; Monte Carlo needs 95 s for the same error per voxel: 118 x", of the
/// method with this name or else the last one that Monte Carlo was compared with; empty without any. Where the
/// noise hides that method's error, it says so.
std::string reportVerdict(const std::vector<Measurement>& rows, int block,
                          const std::string& featured = "default");

}  // namespace vdb_diffuse
