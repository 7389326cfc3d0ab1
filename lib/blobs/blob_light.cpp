#include "blobs/blob_light.h"

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace vdb_diffuse {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Cells per blob: three across what one blob has for itself, ten across its Gaussian.
constexpr size_t kCellsPerBlob = 30;

/// Fewest voxels for a blob: of as many as there are voxels, their widths overlapping, none would be missed.
constexpr size_t kVoxelsPerBlob = 8;

/// Energy that the blobs' solution would gain or lose by more than this is worth a warning.
constexpr double kWorthAWord = 0.1;

struct Place {
  size_t block = 0;
  int voxel = 0;
};

class BlobMethod : public ChannelSolver {
 public:
  BlobMethod(const Medium& medium, const BlobSettings& settings, const Progress& progress)
      : medium_(medium), settings_(settings), progress_(progress) {
    const double start = now();
    const size_t most = (medium.topology().activeVoxelCount() + kVoxelsPerBlob - 1) / kVoxelsPerBlob;
    cells_ = findCells(medium, kCellsPerBlob * static_cast<size_t>(settings.count));
    FitSettings fit;
    fit.count = static_cast<int>(std::min(static_cast<size_t>(settings.count), most));
    fit.overlap = settings.overlap.value_or(overlapOf(settings.form));
    fit.progress = progress;
    blobs_ = fitBlobs(cells_, fit);
    basis_ = basisOnCells(blobs_, cells_);
    report_.blobs = blobs_.size();
    report_.seconds_fit = now() - start;
  }

  const BlobReport& report() const { return report_; }

  FirstScatter light(const Scene& scene, const Occluder& occluder, Model model,
                     const FirstScatterSettings& usual) override {
    if (!settings_.source_at_centres) return firstScatter(medium_, scene, occluder, model, usual);
    const std::vector<Place> places = centreVoxels();
    std::vector<BlockMask> only(medium_.topology().blockCount());
    for (const Place& place : places) only[place.block].setOn(place.voxel);
    FirstScatterSettings sparse = usual;
    sparse.exact_march = true;
    sparse.want_shape = false;
    sparse.only = &only;
    FirstScatter source = firstScatter(medium_, scene, occluder, model, sparse);
    const auto spread = [&](Field<float>& field) {
      std::vector<double> values;
      for (const Place& place : places) values.push_back(field.block(place.block)[place.voxel]);
      evaluate(blobs_, basis_, cells_, medium_.topology(), values, field);
    };
    for (Channels* fields : {&source.direct, &source.beam})
      for (Field<float>& field : *fields) spread(field);
    for (std::vector<VectorField>* fields : {&source.beam_flux, &source.direct_flux})
      for (VectorField& field : *fields)
        for (Field<float>& component : field) spread(component);
    return source;
  }

  DirectionSet probe() const override { return offPlanesInRings(); }

  void setUp(const Equation& equation) override {
    system_ = formBlobSystem(blobs_, cells_, basis_, equation, medium_, settings_.form, progress_);
    solver_ = std::make_unique<BlobSolver>(system_, settings_.form);
  }

  SolveReport solve(const Equation& equation, const RightHandSide& rhs, double tolerance, Field<double>& x,
                    std::vector<std::string>& warnings) override {
    BlobSolveReport solved;
    const std::vector<double> I = solver_->solve(projected(rhs.b), 0.01 * tolerance, solved);
    evaluate(blobs_, basis_, cells_, medium_.topology(), I, x);
    const double excess = closeEnergy(equation, rhs.b, x);
    report_.condition_number = std::max(report_.condition_number, solved.condition_number);
    if (equation.settings.walls && !equation.settings.walls->empty())
      warnings.push_back(
          "blobs reach through the surfaces inside the volume; multigrid keeps the light apart");
    char line[200];
    if (solved.regularised) {
      std::snprintf(line, sizeof line,
                    "the blobs' system is nearly singular (condition number %.2g) and was regularised: fewer "
                    "blobs, or some absorption, would help",
                    solved.condition_number);
      warnings.push_back(line);
    }
    if (std::abs(excess) > kWorthAWord) {
      std::snprintf(line, sizeof line,
                    "the blobs' solution lost or gained energy, and was made %.0f %% %s to close it",
                    100 * std::abs(excess), excess > 0 ? "brighter" : "darker");
      warnings.push_back(line);
    }
    SolveReport report;
    report.converged = solved.converged;
    report.iterations = solved.iterations;
    report.relative_residual = solved.relative_residual;
    return report;
  }

 private:
  const Medium& medium_;
  const BlobSettings settings_;
  const Progress progress_;
  Cells cells_;
  std::vector<Blob> blobs_;
  CellBasis basis_;
  BlobSystem system_;
  std::unique_ptr<BlobSolver> solver_;
  BlobReport report_;

  /// The cell of each blob whose centre is nearest to the blob's. A blob may be centred where there is no
  /// voxel.
  std::vector<int32_t> centreCells() const {
    std::vector<int32_t> nearest(blobs_.size(), 0);
    std::vector<double> least(blobs_.size(), HUGE_VAL);
    for (size_t b = 0; b < basis_.blobs.size(); ++b)
      for (size_t c = cells_.first[b]; c < cells_.first[b + 1]; ++c) {
        const float* value = &basis_.value[basis_.at(b, c - cells_.first[b])];
        for (const int32_t i : basis_.blobs[b]) {
          const double d = (cells_.centre[c] - blobs_[i].centre).lengthSqr();
          if (*value++ == 0 || d >= least[i]) continue;
          least[i] = d;
          nearest[i] = static_cast<int32_t>(c);
        }
      }
    return nearest;
  }

  std::vector<Place> centreVoxels() const {
    const std::vector<int32_t> centre = centreCells();
    std::vector<Place> places;
    for (size_t i = 0; i < blobs_.size(); ++i) {
      Place place;
      const auto after = std::upper_bound(cells_.first.begin(), cells_.first.end(), size_t(centre[i]));
      place.block = static_cast<size_t>(after - cells_.first.begin()) - 1;
      double least = HUGE_VAL;
      for (auto it = medium_.topology().active(place.block).beginOn(); it; ++it) {
        const int n = static_cast<int>(it.pos());
        if (cells_.of(place.block, n) != centre[i]) continue;
        const Vec3d p = cells_.corner[place.block] + voxelLocal(n).asVec3d() * cells_.stretch;
        if ((p - blobs_[i].centre).lengthSqr() >= least) continue;
        least = (p - blobs_[i].centre).lengthSqr();
        place.voxel = n;
      }
      places.push_back(place);
    }
    return places;
  }

  /// b as the blobs are tested with it: in the mean over psi_j, or at the centres.
  std::vector<double> projected(const Field<float>& b) const {
    const std::vector<double> sums =
        sumOverCells(cells_, medium_.topology(), [&](size_t block, int n) { return b.block(block)[n]; });
    if (settings_.form == BlobForm::kGalerkin) return weighedByBlobs(basis_, cells_, blobs_.size(), sums);
    std::vector<double> projection;
    for (const int32_t c : centreCells()) projection.push_back(sums[c] / cells_.volume[c]);
    return projection;
  }

  /// Brightens x until as much is absorbed and leaves as comes in: the sums over cells are not quite those
  /// over voxels, and collocation conserves nothing. Returns by how much, as a fraction.
  double closeEnergy(const Equation& equation, const Field<float>& b, Field<double>& x) const {
    const auto over = [&](const auto& term) {
      return sumOverBlocks<double>(b.blockCount(), [&](size_t block) {
        double sum = 0;
        for (int n = 0; n < kBlockVoxels; ++n) sum += term(block, n);
        return sum;
      });
    };
    const double in = over([&](size_t block, int n) { return b.block(block)[n]; });
    const double out =
        over([&](size_t block, int n) { return equation.A->sink.block(block)[n] * x.block(block)[n]; });
    if (!(in > 0 && out > 0)) return 0;
    const double factor = in / out;
    forEachBlock(b.blockCount(), [&](size_t block) {
      for (int n = 0; n < kBlockVoxels; ++n) x.block(block)[n] *= factor;
    });
    return factor - 1;
  }
};

}  // namespace

DiffuseResult blobLight(const Medium& medium, const Scene& scene, const DiffuseSettings& settings,
                        const BlobSettings& blobs, BlobReport* report) {
  BlobMethod method(medium, blobs, settings.progress);
  DiffuseSettings own = settings;
  own.solver = &method;
  own.refine = {};
  DiffuseResult result = diffuse(medium, scene, own);
  result.seconds_setup += method.report().seconds_fit;
  if (blobs.source_at_centres && blobs.want_direct) {
    const double start = now();
    FirstScatterSettings full = settings.source;
    full.progress = settings.progress;
    result.direct = firstScatter(medium, scene, Occluder(scene.surfaces), settings.model.model, full).direct;
    result.seconds_source += now() - start;
  }
  if (report) *report = method.report();
  return result;
}

}  // namespace vdb_diffuse
