#pragma once

#include <string>

#include "bandwidth.h"
#include "comparison.h"

namespace vdb_diffuse::speed {

void printBandwidth(const char* threads, const Bandwidth& bandwidth);

/// \param R  ns per voxel on one thread
void printComparison(const Comparison& comparison, double R);

/// One row for each solver and tolerance. Throws OutputError where the file cannot be written.
void writeCsv(const std::string& path, const std::vector<Comparison>& comparisons, double R);

}  // namespace vdb_diffuse::speed
