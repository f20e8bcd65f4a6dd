// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/camera_check.hpp"

#include "stillmap/optimize/camera_calibration.hpp"
#include "stillmap/refine/map_bundle.hpp"
#include "stillmap/refine/map_depth_error.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace stillmap {
namespace {

/// Limits of the number of keyframes in use, and least number of observations.
constexpr std::size_t kMinKeyframes = 5, kMaxKeyframes = 60, kMinObservations = 1000;
/// Standard deviations by which an intrinsic parameter must be wrong alone, and both focal lengths
/// together. In pieces of good recordings, among them such with people, corrections of more than
/// 4 % of the focal length are up to 3.5 standard deviations.
constexpr double kCertainAlone = 5, kCertainTogether = 4;

/// Returns the keyframes of the largest component in creation order.
std::vector<KeyframeId> main_keyframes(const Map& map) {
  std::vector<KeyframeId> most;
  for (const std::uint32_t component : map.components()) {
    std::vector<KeyframeId> keyframes = keyframes_of(map, component);
    if (keyframes.size() > most.size()) most = std::move(keyframes);
  }
  return most;
}

/// Returns the landmarks that at least two of the keyframes observe.
std::vector<LandmarkId> shared_landmarks(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::map<LandmarkId, int> observed;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.at(id).landmarks) {
      if (landmark.valid()) ++observed[landmark];
    }
  }
  std::vector<LandmarkId> shared;
  for (const auto& [landmark, times] : observed) {
    if (times > 1) shared.push_back(landmark);
  }
  return shared;
}

/// Returns whether a parameter, kFx to kCy, is wrong by at least that many standard deviations.
bool is_wrong(const Camera& given, const CameraCalibration& found, CameraParameter i,
              double certain) {
  const double correction = found.correction(i), sigma = found.sigma(i);
  return is_wrong_intrinsic(correction, sigma, given.fx) && std::abs(correction) > certain * sigma;
}

/// Returns whether both focal lengths are wrong in the same direction, as with the camera file of
/// another camera or image size. People who walk through a small map distort it along one image
/// axis only.
bool shows_wrong_focal_lengths(const Camera& given, const CameraCalibration& found) {
  return is_wrong(given, found, kFx, kCertainTogether) &&
         is_wrong(given, found, kFy, kCertainTogether) &&
         found.correction(kFx) * found.correction(kFy) > 0;
}

/// Returns the focal length fx corrected by the ratio that the more certain of the two shows.
double corrected_focal_length(const Camera& given, const CameraCalibration& found) {
  const auto certainty = [&](int i) { return std::abs(found.correction(i)) / found.sigma(i); };
  if (certainty(kFx) >= certainty(kFy)) return given.fx + found.correction(kFx);
  return given.fx * (1 + found.correction(kFy) / given.fy);
}

}  // namespace

CameraErrors camera_errors(const Map& map) {
  std::vector<KeyframeId> keyframes = main_keyframes(map);
  keyframes.resize(std::min(keyframes.size(), kMaxKeyframes));
  if (keyframes.size() < kMinKeyframes) return {};
  MapBundle bundle =
      make_bundle(map, keyframes, keyframes.size(), shared_landmarks(map, keyframes));
  if (bundle.observations.size() < kMinObservations) return {};
  restore_measured_depths(map, bundle.problem);
  const CameraCalibration found = calibrate_camera(bundle.problem, AlikeErrors::kAssumed);
  const Camera& given = map.camera();
  const auto is_wrong_alone = [&](CameraParameter i) {
    return is_wrong(given, found, i, kCertainAlone);
  };
  CameraErrors errors;
  if (shows_wrong_focal_lengths(given, found) || is_wrong_alone(kFx) || is_wrong_alone(kFy))
    errors.focal_length = corrected_focal_length(given, found);
  if (is_wrong_alone(kCx) || is_wrong_alone(kCy))
    errors.center =
        Eigen::Vector2d(given.cx + found.correction(kCx), given.cy + found.correction(kCy));
  if (shows_distances(found)) errors.disparity_bow = found.correction(kDisparityBow);
  return errors;
}

}  // namespace stillmap
