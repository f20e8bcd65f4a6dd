// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/doubts.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/sensor/frame_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Minimum share of frames with a pose [0..1].
constexpr double kMinCoverage = 0.5;
/// Maximum share of uncertain poses [0..1].
constexpr double kMaxUncertain = 0.2;
/// Share of late frames from which they are reported [0..1].
constexpr double kMaxLate = 0.2;
/// Maximum share of frames for which the masks could not be used [0..1].
constexpr double kMaxWithoutMasks = 0.5;

/// Least number of points of a dense map of this many frames with a pose.
constexpr std::size_t kFewestPoints = 100, kFramesForACloud = 30;
/// Largest ratio of the sides of a pixel, and limits of the focal length [image widths]: fields of
/// view of 136 and 14 degrees.
constexpr double kMostOblong = 1.2, kShortestFocal = 0.2, kLongestFocal = 4;

/// Largest factor by which a given focal length is taken to be wrong.
constexpr double kLargestFocalFactor = 2;

double share(std::size_t part, std::size_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0;
}

/// Returns whether a frame could not be used, other than one of a live camera that was not taken in
/// time.
bool is_unusable(const SkippedFrame& frame) { return frame.frame_lost && !frame.late; }

/// Returns the most frequent reason for a frame without a pose.
std::string main_reason(const RunRecord& record) {
  const SlamResult& result = record.result;
  std::map<std::string, int> count;
  for (const FrameRecord& f : result.frames) {
    if (!f.reason.empty()) ++count[f.reason];
  }
  const auto most = std::max_element(
      count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most != count.end()) return most->first;
  const auto lost = std::find_if(record.skipped.begin(), record.skipped.end(), is_unusable);
  if (lost != record.skipped.end()) return lost->reason;
  return result.frames.empty() ? "no frame could be read" : "the run ended before its map began";
}

void add_coverage(const RunRecord& record, std::vector<std::string>& doubts) {
  const std::size_t total = record.total_frames(), tracked = record.result.tracked();
  if (total > 0 && share(tracked, total) >= kMinCoverage) return;
  if (2 * record.dropped.size() > total - tracked) {
    const bool waits = record.options.network.mask_delay == 0;
    doubts.push_back(fmt::format(
        "only {} of {} frames have a pose: {} were dropped, because reading or tracking takes "
        "longer than the time between two frames; use --schedule lockstep{}",
        tracked, total, record.dropped.size(),
        waits ? ", or do not let tracking wait for the network: --set network.mask_delay=-1" : ""));
    return;
  }
  const bool only_localized = record.loaded && !record.loaded->extended;
  doubts.push_back(fmt::format(
      "only {} of {} frames have a pose (most often: {}); {}check the camera, its depth factor and "
      "the images with: stillmap doctor RECORDING",
      tracked, total, main_reason(record),
      only_localized ? "if the camera was in the place of the loaded map, " : ""));
}

/// Tells many unusable frames.
void add_unusable(const RunRecord& record, std::vector<std::string>& doubts) {
  const auto count = std::count_if(record.skipped.begin(), record.skipped.end(), is_unusable);
  const auto& frames = record.result.frames;
  const double begin = frames.empty() ? 0 : frames.front().timestamp;
  if (!are_many_unusable(record.skipped, begin, record.total_frames())) return;
  const auto& first = *std::find_if(record.skipped.begin(), record.skipped.end(), is_unusable);
  doubts.push_back(fmt::format(
      "{} of {} frames of the recording could not be used; the first: {:.6f}: {}; see what is "
      "wrong with: stillmap doctor RECORDING",
      count, record.total_frames(), first.timestamp, first.reason));
}

/// Tells the longest gap of the trajectory, if most frames have a pose.
void add_gap(const RunRecord& record, std::vector<std::string>& doubts) {
  const auto& frames = record.result.frames;
  const auto has_pose = [](const FrameRecord& f) { return f.has_pose(); };
  auto longest = frames.begin();
  std::ptrdiff_t length = 0;
  for (auto begin = frames.begin(); begin != frames.end();) {
    begin = std::find_if_not(begin, frames.end(), has_pose);
    const auto end = std::find_if(begin, frames.end(), has_pose);
    if (end - begin > length) longest = begin, length = end - begin;
    begin = end;
  }
  const bool told = share(record.result.tracked(), record.total_frames()) < kMinCoverage;
  if (told || !is_long_gap(static_cast<std::size_t>(length), record.total_frames())) return;
  doubts.push_back(fmt::format(
      "{} frames in a row have no pose, from {:.6f} s on ({}): the path has a gap there", length,
      longest->timestamp, longest->reason));
}

void add_uncertain(const RunRecord& record, std::vector<std::string>& doubts) {
  const auto& frames = record.result.frames;
  const auto uncertain = static_cast<std::size_t>(
      std::count_if(frames.begin(), frames.end(),
                    [](const FrameRecord& f) { return f.has_pose() && f.uncertain; }));
  if (share(uncertain, record.result.tracked()) <= kMaxUncertain) return;
  doubts.push_back(fmt::format(
      "{} of {} poses are uncertain: they contradict the motion of the camera, or nearly all that "
      "is in view moves, or the background does; people may fill the image ({}leave out these "
      "frames), the robot itself may be in view (--ignore FILE.png), or the intrinsics may be "
      "wrong (stillmap doctor RECORDING)",
      uncertain, record.result.tracked(),
      record.detector.empty() ? "give a network with --model FILE.onnx, or " : ""));
}

void add_masks(const RunRecord& record, std::vector<std::string>& doubts) {
  const SlamResult& result = record.result;
  if (share(result.detector_failures, result.segmented) > kMaxWithoutMasks) {
    doubts.push_back(
        fmt::format("{} of {} frames have no usable mask ({}); name the folder of masks of this "
                    "recording, in the size of its images, or a network that works",
                    result.detector_failures, result.segmented, result.detector_skipped));
  }
  if (!result.detector_doubt.empty()) doubts.push_back(result.detector_doubt);
  const std::string preset = record.options.preset();
  if (record.detector.empty() && needs_detector(preset)) {
    doubts.push_back(fmt::format(
        "preset {} got neither a network nor masks, so moving objects are tracked as static; name "
        "a network with --model FILE.onnx, or a folder with --masks DIR",
        preset));
  }
  if (record.detector_gives_boxes_only && needs_masks(preset)) {
    doubts.push_back(fmt::format(
        "preset {} needs masks, and the network gives boxes only, so whole boxes are left out; "
        "use a segmentation network such as yolov8n-seg.onnx",
        preset));
  }
}

/// Tells a dense map of next to nothing, once there are some keyframes.
void add_empty_cloud(const RunRecord& record, std::vector<std::string>& doubts) {
  const SlamResult& result = record.result;
  const std::size_t points = result.dense.cloud.size();
  const bool some_frames = result.tracked() >= kFramesForACloud;
  if (!record.options.dense.enabled || result.tracked() == 0) return;
  if (result.keyframes.empty()) return;  // only localized: the cloud is that of the loaded map
  if (record.recovered && record.map && record.map->views.empty()) {
    doubts.push_back(
        "the run was killed before its first view of the dense map was in the journal, so "
        "that map is empty; stillmap run --load-map continues with the keyframes");
    return;
  }
  if (points >= kFewestPoints || (points > 0 && !some_frames)) return;
  doubts.push_back(
      fmt::format("the dense map {}; check dense.voxel, dense.max_depth, dense.stride and "
                  "dense.excluded_classes, and the depth images",
                  points == 0 ? "is empty" : "has only " + counted(points, "point")));
}

/// Tells a focal length that the map contradicts.
void add_wrong_focal_length(const RunRecord& record, std::vector<std::string>& doubts) {
  const auto& fitting = record.result.camera_errors.focal_length;
  if (!fitting) return;
  const double factor = *fitting / record.result.camera.fx;
  if (factor < 1 / kLargestFocalFactor || factor > kLargestFocalFactor) {
    doubts.push_back(
        "the depth images contradict the map, and no focal length near the given one explains it; "
        "check that depth and color are of the same camera and moment with: stillmap doctor "
        "RECORDING");
    return;
  }
  doubts.push_back(fmt::format(
      "the focal length of the camera contradicts the map: {:.0f} pixels are given, and "
      "about {:.0f} fit better, so the map is distorted; find the right one with: "
      "stillmap calibrate RECORDING",
      record.result.camera.fx, *fitting));
}

/// Returns whether the principal point is far from the center of the images and would be near it
/// with cx and cy exchanged.
bool has_exchanged_center(const Camera& camera) {
  constexpr double kNear = 0.05, kFar = 0.1;  // distances from the center [image widths]
  const auto distance = [&](double x, double y) {
    return std::hypot(x - camera.width / 2.0, y - camera.height / 2.0) / camera.width;
  };
  return distance(camera.cx, camera.cy) > kFar && distance(camera.cy, camera.cx) < kNear;
}

/// Tells a principal point that the map contradicts.
void add_wrong_center(const RunRecord& record, std::vector<std::string>& doubts) {
  const Camera& camera = record.result.camera;
  const auto& fitting = record.result.camera_errors.center;
  if (!fitting || has_exchanged_center(camera)) return;
  doubts.push_back(fmt::format(
      "the principal point of the camera contradicts the map: ({:.0f}, {:.0f}) is given, and about "
      "({:.0f}, {:.0f}) fits better, so the map is distorted; find the right one with: "
      "stillmap calibrate RECORDING",
      camera.cx, camera.cy, fitting->x(), fitting->y()));
}

/// Tells depth images that hold distances from the camera.
void add_distances(const RunRecord& record, std::vector<std::string>& doubts) {
  constexpr double kExample = 2;  // [m]
  const auto& bow = record.result.camera_errors.disparity_bow;
  if (!bow) return;
  const double corner = 1 / (1 / kExample + *bow);
  const std::string example =
      corner > kExample && corner < 5 * kExample
          ? fmt::format(" (surfaces {:.2f} m away are {:.2f} m there)", kExample, corner)
          : "";
  doubts.push_back("the depths grow towards the corners of the image" + example +
                   ", as if they were distances from the camera instead of depths along its "
                   "optical axis; divide them by sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2)");
}

/// Tells intrinsics that hardly any camera has: pixels that are not square, a principal point far
/// from the center of the image, or an extreme field of view.
void add_unlikely_camera(const Camera& camera, std::vector<std::string>& doubts) {
  if (camera.width == 0 || camera.fx <= 0 || camera.fy <= 0) return;
  const double aspect = camera.fx / camera.fy, focal = camera.fx / camera.width;
  const double cx = camera.cx / camera.width, cy = camera.cy / camera.height;
  const auto central = [](double share) { return share > 0.25 && share < 0.75; };
  if (has_exchanged_center(camera)) {
    doubts.push_back(fmt::format(
        "the principal point (cx {:g}, cy {:g}) is far from the center of the images of {} x {} "
        "pixels, and would be near it with cx and cy exchanged; exchange them in the camera file",
        camera.cx, camera.cy, camera.width, camera.height));
    return;
  }
  const bool likely = aspect > 1 / kMostOblong && aspect < kMostOblong && central(cx) &&
                      central(cy) && focal > kShortestFocal && focal < kLongestFocal;
  if (likely) return;
  doubts.push_back(fmt::format(
      "the intrinsics of the camera are unlikely (fx {:g}, fy {:g}, cx {:g}, cy {:g} for images of "
      "{} x {} pixels); check them with: stillmap doctor RECORDING",
      camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height));
}

}  // namespace

bool needs_detector(const std::string& preset) {
  return needs_masks(preset) || preset == "box-flow" || preset == "box-epipolar";
}

bool needs_masks(const std::string& preset) {
  return preset == "seg-mask" || preset == "gated-seg";
}

std::optional<std::string> note_on_late_frames(const RunRecord& record) {
  const std::size_t late = record.late_frames().size(), total = record.total_frames();
  const bool told = share(record.result.tracked(), total) < kMinCoverage;
  if (told || share(late, total) <= kMaxLate) return std::nullopt;
  return fmt::format(
      "{} of {} frames have no pose because the computer was still busy when they came; {}", late,
      total,
      record.dropped.empty() ? "use a lower frame rate, smaller images or a faster computer"
                             : "to use all frames of a recording: --schedule lockstep");
}

std::vector<std::string> doubts_of(const RunRecord& record) {
  std::vector<std::string> doubts;
  add_masks(record, doubts);  // a cause of the next ones
  add_coverage(record, doubts);
  add_unusable(record, doubts);
  add_gap(record, doubts);
  add_uncertain(record, doubts);
  if (!record.result.carried_doubt.empty()) doubts.push_back(record.result.carried_doubt);
  doubts.insert(doubts.end(), record.frame_problems.begin(), record.frame_problems.end());
  const SlamResult& result = record.result;
  if (result.maps > 1) {
    doubts.push_back(
        fmt::format("there are {} maps that are not connected, so the poses of one say nothing "
                    "about those of another; record the places in one run, or return to the first",
                    result.maps));
  }
  add_empty_cloud(record, doubts);
  add_wrong_focal_length(record, doubts);
  add_wrong_center(record, doubts);
  add_distances(record, doubts);
  add_unlikely_camera(result.camera, doubts);
  return doubts;
}

}  // namespace stillmap
