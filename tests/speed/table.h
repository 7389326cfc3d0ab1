#pragma once

#include <string>

#include "bandwidth.h"
#include "comparison.h"
#include "phases.h"

namespace vdb_diffuse::speed {

void printBandwidth(const char* threads, const Bandwidth& bandwidth);

/// \param R  ns per voxel on one thread
void printComparison(const Comparison& comparison, double R);

/// \param triad  GB/s on one thread: the limit of a step is what it moves at that speed
void printPhases(const Phases& phases, double R, double triad);
/// One row for each step and number of threads. Throws OutputError where the file cannot be written.
void writePhases(const std::string& path, const std::vector<Phases>& sizes, double R);
/// Steps against size on one thread, as SVG or PNG by the name's ending.
void drawPhases(const std::string& path, const std::vector<Phases>& sizes);

/// One row for each solver and tolerance. Throws OutputError where the file cannot be written.
void writeCsv(const std::string& path, const std::vector<Comparison>& comparisons, double R);

}  // namespace vdb_diffuse::speed
