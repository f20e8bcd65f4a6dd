// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/moving_background.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/track/moving_majority.hpp"

#include <algorithm>
#include <array>

namespace stillmap {
namespace {

/// Least share of moving keypoints [0..1], least ratio of their median depth to that of the static
/// ones, and least share of them on each of three sides [0..1].
constexpr double kLeastShare = 0.2, kFarther = 1.3, kOnASide = 0.1;

/// Returns the median depth of the moving or static keypoints [m]; 0 if none has a depth.
double median_depth(const Features& features, const std::vector<float>& weight, bool moving) {
  std::vector<float> depths;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const float depth = features.keypoints[i].depth;
    if ((weight[i] == 0) == moving && depth > 0) depths.push_back(depth);
  }
  return depths.empty() ? 0 : upper_median(depths);
}

/// Returns the shares of the moving keypoints in the quadrants around the center of the static
/// ones.
std::array<double, 4> shares_around_static(const Features& features,
                                           const std::vector<float>& weight) {
  double u = 0, v = 0, still = 0, moving = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (weight[i] == 0) continue;
    u += features.keypoints[i].u, v += features.keypoints[i].v, ++still;
  }
  std::array<double, 4> shares{};
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (weight[i] != 0) continue;
    const Keypoint& k = features.keypoints[i];
    ++shares[(k.u * still > u ? 1U : 0U) + (k.v * still > v ? 2U : 0U)];
    ++moving;
  }
  for (double& share : shares) share /= std::max(1.0, moving);
  return shares;
}

}  // namespace

bool background_moves(const Features& features, const std::vector<float>& weight) {
  if (weight.size() != features.size() || moving_share(weight) < kLeastShare) return false;
  const double still = median_depth(features, weight, false);
  if (still == 0 || median_depth(features, weight, true) < kFarther * still) return false;
  const auto shares = shares_around_static(features, weight);
  return std::ranges::count_if(shares, [](double share) { return share > kOnASide; }) >= 3;
}

}  // namespace stillmap
