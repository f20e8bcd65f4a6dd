// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/rest_detector.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace stillmap {
namespace {

/// Number of frames in which a camera that moves is seen to move.
constexpr std::size_t kFrames = 10;

/// Largest distance of two keypoints that are one [pixels of its pyramid level], and Hamming
/// distance of their descriptors [bits].
constexpr float kRadius = 3;
constexpr int kEqual = 50;
/// Largest length of the median displacement, and largest median of the lengths [pixels of the
/// pyramid level]. At rest: 0.00 and 0.03 to 0.05 in rendered images with the noise of a camera. A
/// hand that holds still reaches 0.15 for moments, and mostly 1 to 2 (kitchen_sitting_static).
constexpr float kMaxMedian = 0.02F, kMaxLength = 0.08F;
/// Least number of keypoints that are found again.
constexpr std::size_t kFewest = 30;
/// Regions of the image, and the number of keypoints from which one counts.
constexpr int kColumns = 8, kRows = 6, kKeypointsOfRegion = 6;
/// A region is still if this share of its keypoints moves by less than a pixel; the least share of
/// still regions: somebody who walks ahead of a moving camera, or a part that it carries, stays
/// still in fewer of them.
constexpr double kStillShare = 1.0 / 3, kLeastStill = 0.4;

/// Time that a view may be covered until the camera may have moved meanwhile [s].
constexpr double kLongestCover = 3;

/// Accuracy of the displacement by all keypoints [pixels].
constexpr double kAccuracy = 0.004;
/// Depth of what is seen, if that is not known [m].
constexpr float kUsualDepth = 3;

int region_of(const Camera& camera, const Keypoint& k) {
  const auto cell = [](float x, int size, int cells) {
    return std::clamp(static_cast<int>(x * static_cast<float>(cells) / static_cast<float>(size)), 0,
                      cells - 1);
  };
  return cell(k.v, camera.height, kRows) * kColumns + cell(k.u, camera.width, kColumns);
}

/// Returns the displacement of a keypoint since another image [pixels of its level]; none if it is
/// not found near its place.
std::optional<cv::Point2f> displacement(const Features& now, std::size_t keypoint,
                                        const Features& before, float scale) {
  const Keypoint& k = now.keypoints[keypoint];
  int best = kEqual + 1;
  std::optional<cv::Point2f> moved;
  before.grid.for_each_near(k.u, k.v, kRadius * scale, k.level, k.level, [&](std::uint32_t i) {
    const int bits = distance(now.descriptors[keypoint], before.descriptors[i]);
    if (bits >= best) return;
    best = bits;
    moved = cv::Point2f(k.u - before.keypoints[i].u, k.v - before.keypoints[i].v) / scale;
  });
  return moved;
}

/// Returns the information of a pose that is known up to kAccuracy in the image.
Matrix6d information_of(const Camera& camera, const Features& features) {
  std::vector<float> depths;
  for (const Keypoint& k : features.keypoints) {
    if (k.depth > 0) depths.push_back(k.depth);
  }
  const double depth = depths.empty() ? kUsualDepth : upper_median(depths);
  const double radians = kAccuracy / camera.fx, meters = radians * depth;
  Vector6d information;
  information << Eigen::Vector3d::Constant(1 / (meters * meters)),
      Eigen::Vector3d::Constant(1 / (radians * radians));
  return information.asDiagonal();
}

}  // namespace

PoseComparison compare_poses(const TrackingModel& model, const Features& a, const Features& b,
                             bool all_over) {
  struct Region {
    int keypoints = 0, still = 0;
  };
  std::array<Region, kColumns * kRows> regions;
  std::vector<float> du, dv, lengths;
  for (std::size_t i = 0; i < a.size(); ++i) {
    Region& region = regions[static_cast<std::size_t>(region_of(model.camera, a.keypoints[i]))];
    ++region.keypoints;
    const auto scale = static_cast<float>(model.pyramid.scale(a.keypoints[i].level));
    const auto moved = displacement(a, i, b, scale);
    if (!moved) continue;
    du.push_back(moved->x), dv.push_back(moved->y);
    lengths.push_back(std::hypot(moved->x, moved->y));
    region.still += lengths.back() < 1;
  }
  if (lengths.size() < kFewest) return PoseComparison::kUnknown;
  if (std::hypot(upper_median(du), upper_median(dv)) > kMaxMedian ||
      upper_median(lengths) > kMaxLength)
    return PoseComparison::kOther;
  if (!all_over) return PoseComparison::kSame;
  int counted = 0, still = 0;
  for (const Region& region : regions) {
    if (region.keypoints < kKeypointsOfRegion) continue;
    ++counted;
    still += region.still >= kStillShare * region.keypoints;
  }
  return still >= kLeastStill * counted ? PoseComparison::kSame : PoseComparison::kUnknown;
}

std::optional<PosePrior> RestDetector::pose(const TrackingModel& model, const Features& features,
                                            const LocalMap& local_map) {
  if (start_ && local_map.made_for_frame == start_->index) {
    start_->reference = local_map.reference;
    earlier_.push_back(*std::exchange(start_, std::nullopt));
  }
  const auto compared = [&](const View& view, bool all_over) {
    return local_map.find(view.reference) == nullptr
               ? PoseComparison::kUnknown
               : compare_poses(model, features, *view.features, all_over);
  };
  const auto with_rest = rest_ ? compared(*rest_, false) : PoseComparison::kUnknown;
  at_rest_ = with_rest == PoseComparison::kSame;
  // Otherwise a camera that creeps would be at rest where it was ten frames ago, again and again.
  if (with_rest == PoseComparison::kOther) earlier_.clear();
  if (!at_rest_ && !earlier_.empty() && compared(earlier_.front(), true) == PoseComparison::kSame) {
    at_rest_ = true;
    rest_ = earlier_.front();
  }
  if (!at_rest_) return std::nullopt;
  const Pose& T_world_reference = local_map.find(rest_->reference)->T_world_camera;
  return PosePrior{T_world_reference * rest_->T_reference_camera,
                   information_of(model.camera, features)};
}

bool RestDetector::may_last(double timestamp) const {
  return at_rest_until_ && timestamp - *at_rest_until_ < kLongestCover;
}

void RestDetector::add(const TrackedFrame& tracked) {
  View view{tracked.frame->index(), tracked.frame->features, tracked.reference,
            tracked.T_reference_camera};
  if (tracked.state == TrackState::kStarted) {
    *this = {};
    start_ = view;
    return;
  }
  if (tracked.starts_part()) return;
  if (at_rest_) {
    at_rest_until_ = tracked.frame->timestamp();
    view.reference = rest_->reference;
    view.T_reference_camera = rest_->T_reference_camera;
  }
  earlier_.push_back(view);
  if (earlier_.size() > kFrames) earlier_.pop_front();
}

}  // namespace stillmap
