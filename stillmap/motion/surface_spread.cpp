// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/surface_spread.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Distance along a surface that a depth jump of one meter counts as [m].
constexpr double kJumpCost = 10;

/// Share of a cell's value that reaches a neighboring cell [0..1], by their depths a and b.
class Passage {
 public:
  Passage(double focal, const DepthPolynomial<float>& tolerance)
      : tolerance_(tolerance), lateral_(static_cast<float>(1 / (focal * SurfaceSpread::kReach))) {}

  float operator()(float a, float b) const {
    if (a <= 0 || b <= 0) return 0;
    const float z = std::min(a, b);
    const float jump = std::max(0.0F, std::abs(a - b) - tolerance_.at(z) / 2);
    const float x = lateral_ * z + jump_ * jump;
    const float e1 = 1 / (1 + x / 8), e2 = e1 * e1, e4 = e2 * e2;
    return e4 * e4;  // approximates exp(-x)
  }

 private:
  DepthPolynomial<float> tolerance_;
  float lateral_;
  float jump_ = static_cast<float>(kJumpCost / SurfaceSpread::kReach);
};

/// One forward and one backward pass along a line of cells; share[i] is the share that reaches cell
/// i from i - 1.
void spread_row(const float* in, const float* share, int count, float* out) {
  float propagated = 0;
  for (int i = 0; i < count; ++i) out[i] = propagated = in[i] + share[i] * propagated;
  propagated = 0;
  for (int i = count - 1; i >= 0; --i) {
    out[i] += propagated;
    propagated = share[i] * (in[i] + propagated);
  }
}

void spread_columns(const cv::Mat1f& in, const cv::Mat1f& share, cv::Mat1f& out) {
  const int columns = in.cols;
  std::vector<float> propagated(static_cast<std::size_t>(columns), 0.0F);
  for (int r = 0; r < in.rows; ++r) {
    const float *value = in.ptr<float>(r), *shares = share.ptr<float>(r);
    auto* result = out.ptr<float>(r);
    for (int c = 0; c < columns; ++c)
      result[c] = propagated[c] = value[c] + shares[c] * propagated[c];
  }
  std::fill(propagated.begin(), propagated.end(), 0.0F);
  for (int r = in.rows - 1; r >= 0; --r) {
    const float *value = in.ptr<float>(r), *shares = share.ptr<float>(r);
    auto* result = out.ptr<float>(r);
    for (int c = 0; c < columns; ++c) {
      result[c] += propagated[c];
      propagated[c] = shares[c] * (value[c] + propagated[c]);
    }
  }
}

}  // namespace

SurfaceSpread::SurfaceSpread(const CellGrid& grid)
    : from_left_(grid.size(), 0.0F), from_above_(grid.size(), 0.0F) {
  const Passage horizontal(grid.camera.fx, grid.tolerance);
  const Passage vertical(grid.camera.fy, grid.tolerance);
  for (int r = 0; r < grid.depth.rows; ++r) {
    const auto* here = grid.depth.ptr<float>(r);
    auto* left = from_left_.ptr<float>(r);
    for (int c = 1; c < grid.depth.cols; ++c) left[c] = horizontal(here[c - 1], here[c]);
    if (r == 0) continue;
    const auto* above = grid.depth.ptr<float>(r - 1);
    auto* up = from_above_.ptr<float>(r);
    for (int c = 0; c < grid.depth.cols; ++c) up[c] = vertical(above[c], here[c]);
  }
}

cv::Mat1f SurfaceSpread::operator()(const cv::Mat1f& values) const {
  cv::Mat1f along(values.size()), result(values.size());
  for (int r = 0; r < values.rows; ++r) {
    spread_row(values.ptr<float>(r), from_left_.ptr<float>(r), values.cols, along.ptr<float>(r));
  }
  spread_columns(along, from_above_, result);
  return result;
}

}  // namespace stillmap
