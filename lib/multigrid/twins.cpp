#include "multigrid/twins.h"

namespace vdb_diffuse {
namespace {

constexpr size_t kRowGrain = 256;  ///< rows a thread takes at a time: some microseconds of work

float& valueOf(Node node, Field<float>& field, std::vector<float>& of_twins) {
  return node < 0 ? of_twins[~node] : field[node];
}
float valueOf(Node node, const Field<float>& field, const std::vector<float>& of_twins) {
  return node < 0 ? of_twins[~node] : field[node];
}

}  // namespace

void relaxTwins(Twins& twins, const Field<float>& x, bool reverse, const std::vector<float>* pending) {
  const size_t count = twins.size();
  for (size_t i = 0; i < count; ++i) {
    const size_t t = reverse ? count - 1 - i : i;
    float sum = twins.b[t];
    for (int32_t k = twins.first[t]; k < twins.first[t + 1]; ++k) {
      const Twins::Link& link = twins.links[k];
      float value = valueOf(link.to, x, twins.x);
      if (pending && link.to >= 0) value += (*pending)[link.row];
      sum += link.g * value;
    }
    twins.x[t] = sum * twins.inverse[t];
  }
}

std::vector<float> addFromTwins(const Twins& twins, Field<float>& b) {
  std::vector<float> before;
  before.reserve(twins.links.size());
  for (size_t t = 0; t < twins.size(); ++t)
    for (int32_t k = twins.first[t]; k < twins.first[t + 1]; ++k) {
      const Twins::Link& link = twins.links[k];
      if (link.to < 0) continue;
      before.push_back(b[link.to]);
      b[link.to] += link.g * twins.x[t];
    }
  return before;
}

void putBack(const Twins& twins, const std::vector<float>& before, Field<float>& b) {
  size_t last = before.size();
  for (size_t k = twins.links.size(); k-- > 0;)
    if (twins.links[k].to >= 0) b[twins.links[k].to] = before[--last];
}

void restrictRows(const Operator& A, const Twins& twins, const Field<float>& b, const Field<float>& x,
                  const Interpolation& interpolation, Field<float>& coarse_b, Twins& coarse) {
  coarse.b.assign(coarse.size(), 0.0f);
  std::vector<float> from_twins(interpolation.rows(), 0.0f);
  for (size_t t = 0; t < twins.size(); ++t)
    for (int32_t k = twins.first[t]; k < twins.first[t + 1]; ++k)
      if (twins.links[k].to >= 0) from_twins[twins.links[k].row] += twins.links[k].g * twins.x[t];
  std::vector<float> seen(interpolation.rows(), 0.0f), residual(interpolation.rows());
  forEachBlock(
      interpolation.rows(),
      [&](size_t row) {
        const Node node = interpolation.fine[row];
        if (node < 0) {
          const size_t t = static_cast<size_t>(~node);
          float sum = twins.b[t] - twins.sink[t] * twins.x[t];
          for (int32_t k = twins.first[t]; k < twins.first[t + 1]; ++k)
            sum -= twins.links[k].g * (twins.x[t] - valueOf(twins.links[k].to, x, twins.x));
          residual[row] = sum;
        } else {
          float sum = b[node] - A.sink[node] * x[node];
          forEachFace(A, node, [&](int, Node next, float g) { sum -= g * (x[node] - x[next]); });
          seen[row] = sum;  // what the blocks take it for
          residual[row] = sum + from_twins[row];
        }
      },
      kRowGrain);
  for (size_t row = 0; row < interpolation.rows(); ++row)
    for (int32_t k = interpolation.first[row]; k < interpolation.first[row + 1]; ++k) {
      const Interpolation::Weight& weight = interpolation.weights[k];
      valueOf(weight.coarse, coarse_b, coarse.b) += weight.own * residual[row] - weight.blocks * seen[row];
    }
}

std::vector<float> prolongRows(const Interpolation& interpolation, const Field<float>& e, const Twins& coarse,
                               Field<float>& x, Twins& twins) {
  std::vector<float> pending(interpolation.rows());
  for (size_t row = 0; row < interpolation.rows(); ++row) {
    float own = 0, blocks = 0;
    for (int32_t k = interpolation.first[row]; k < interpolation.first[row + 1]; ++k) {
      const Interpolation::Weight& weight = interpolation.weights[k];
      const float value = valueOf(weight.coarse, e, coarse.x);
      own += weight.own * value;
      blocks += weight.blocks * value;
    }
    valueOf(interpolation.fine[row], x, twins.x) += own - blocks;
    pending[row] = blocks;
  }
  return pending;
}

}  // namespace vdb_diffuse
