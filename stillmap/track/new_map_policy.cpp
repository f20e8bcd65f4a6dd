// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/new_map_policy.hpp"

#include "stillmap/map/visibility.hpp"
#include "stillmap/track/local_map_tracking.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Least number of static keypoints with depth that start a map.
constexpr int kMinStartPoints = 100;
/// The image is divided into 4 x 4 parts. kMinStartParts of them must have kPointsOfPart such
/// keypoints: if all are crowded into a corner they belong to an object, not to the scene.
constexpr int kPartsPerSide = 4, kPointsOfPart = 3, kMinStartParts = 4;

/// Share of the expected landmarks behind a near surface above which the camera is occluded [0..1].
constexpr double kOccludedShare = 0.5;
/// Largest distance of an occluding surface [m]. At 1.2 m a person fills half of a Kinect's image.
constexpr double kOccluderReach = 1.2;
/// Largest depth of an occluding surface as a share of the landmark's depth. If the camera was
/// carried to another place about half of the landmarks are hidden too, but by surfaces as far
/// away as those of any room.
constexpr double kMuchNearer = 0.6;

/// Static keypoints with depth.
struct StartPoints {
  int count = 0;
  int parts = 0;  ///< number of parts of the image with at least kPointsOfPart of them
};

StartPoints start_points(const Frame& frame, const Camera& camera) {
  std::array<int, kPartsPerSide * kPartsPerSide> in_part{};
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    if (k.depth <= 0 || frame.evidence.weight[i] <= 0) continue;
    const auto part = [](float at, int size) {
      return std::clamp(static_cast<int>(kPartsPerSide * at / static_cast<float>(size)), 0,
                        kPartsPerSide - 1);
    };
    ++in_part.at(kPartsPerSide * part(k.v, camera.height) + part(k.u, camera.width));
  }
  return {std::accumulate(in_part.begin(), in_part.end(), 0),
          static_cast<int>(std::count_if(in_part.begin(), in_part.end(),
                                         [](int count) { return count >= kPointsOfPart; }))};
}

}  // namespace

std::string reason_against_new_map(const Frame& frame, const Camera& camera) {
  const StartPoints points = start_points(frame, camera);
  if (points.count < kMinStartPoints) {
    return fmt::format("{} static keypoints with depth, {} are needed to start a map", points.count,
                       kMinStartPoints);
  }
  if (points.parts < kMinStartParts) {
    return fmt::format(
        "static keypoints in {} of {} parts of the image, {} are needed to start a map",
        points.parts, kPartsPerSide * kPartsPerSide, kMinStartParts);
  }
  return {};
}

bool is_occluded(const TrackingModel& model, const LocalMap& local_map, const Pose& T_world_camera,
                 const Frame& frame) {
  const LandmarkProjector view(model.camera, model.pyramid, T_world_camera);
  int expected = 0, hidden = 0;
  for (const LocalLandmark& landmark : local_map.landmarks) {
    const auto query = view.expect(landmark, kLandmarkSearchRadius, kMinViewCosine);
    if (!query) continue;
    const float seen = frame.cells->depth(frame.cells->cell_of(query->u, query->v));
    ++expected;
    const double much_nearer = kMuchNearer * view.depth(landmark.p_world);
    hidden += seen > 0 && seen < std::min(kOccluderReach, much_nearer);
  }
  return hidden > kOccludedShare * expected;
}

bool NewMapPolicy::wants_map(const TrackingModel& model, const LocalMapPtr& local_map,
                             const Pose& T_world_camera, const Frame& frame) {
  if (!reason_against_new_map(frame, model.camera).empty()) return false;
  const bool occluded = local_map && is_occluded(model, *local_map, T_world_camera, frame);
  if (occluded && ++occluded_ <= options_.occluded_patience) return false;
  return ++candidates_ > options_.patience;
}

}  // namespace stillmap
