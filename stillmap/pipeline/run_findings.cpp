// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/run_findings.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/sensor/frame_check.hpp"
#include "stillmap/sensor/unlikely_camera.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns whether the paper of a preset uses masks, so that the boxes of a network are not enough.
bool needs_masks(const std::string& preset) {
  return preset == "seg-mask" || preset == "gated-seg";
}

/// Returns whether the paper of a preset uses a network's boxes or masks.
bool needs_detector(const std::string& preset) {
  return needs_masks(preset) || preset == "box-flow" || preset == "box-epipolar";
}

/// Minimum share of frames with a pose [0..1].
constexpr double kMinCoverage = 0.5;
/// Maximum share of poses that are uncertain as they contradict the motion [0..1]. Poses of which
/// nearly all keypoints move are mostly right: 4 of 5 such pieces of recordings err by millimeters.
constexpr double kMaxUncertain = 0.2;
/// Share of late frames from which they are reported [0..1].
constexpr double kMaxLate = 0.2;
/// Maximum share of frames for which the masks could not be used [0..1].
constexpr double kMaxWithoutMasks = 0.5;
/// Share from which masks are those of another recording.
constexpr double kMasksOfOthers = 0.9;

/// Least number of points of a dense map of this many frames with a pose.
constexpr std::size_t kFewestPoints = 100, kFramesForACloud = 30;
/// Largest factor by which a given focal length is taken to be wrong.
constexpr double kLargestFocalFactor = 2;

double share(std::size_t part, std::size_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : 0;
}

/// Returns whether a frame could not be used, other than one of a live camera that was not taken in
/// time.
bool is_unusable(const SkippedFrame& frame) { return frame.frame_lost && !frame.late; }

/// Returns the most frequent reason for a frame without a pose.
std::string main_reason(const RunDetails& record) {
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

void add_coverage(const RunDetails& record, std::vector<Finding>& findings) {
  const std::size_t total = record.total_frames(), tracked = record.result.tracked();
  if (total > 0 && share(tracked, total) >= kMinCoverage) return;
  if (2 * record.dropped.size() > total - tracked) {
    const bool waits = record.options.network.mask_delay == 0;
    findings.push_back(make_finding(
        "low-coverage",
        fmt::format("only {} of {} {} a pose: {} were dropped, because reading or tracking takes "
                    "longer than the time between two frames",
                    tracked, counted(total, "frame"), have(total), record.dropped.size()),
        fmt::format("use --schedule lockstep{}",
                    waits ? ", or do not let tracking wait for the network: --set "
                            "network.mask_delay=-1"
                          : ""),
        {{"share", share(tracked, total)}}));
    return;
  }
  const bool only_localized = record.loaded && !record.loaded->extended;
  findings.push_back(make_finding(
      "low-coverage",
      fmt::format("only {} of {} {} a pose (most often: {})", tracked, counted(total, "frame"),
                  have(total), main_reason(record)),
      fmt::format("{}check the camera, its depth factor and the images with: stillmap "
                  "doctor RECORDING",
                  only_localized ? "if the camera was in the place of the loaded map, " : ""),
      {{"share", share(tracked, total)}}));
}

/// Adds many unusable frames.
void add_unusable(const RunDetails& record, std::vector<Finding>& findings) {
  const auto count = static_cast<std::size_t>(
      std::count_if(record.skipped.begin(), record.skipped.end(), is_unusable));
  const auto& frames = record.result.frames;
  const double begin = frames.empty() ? 0 : frames.front().timestamp;
  if (!are_many_unusable(record.skipped, begin, record.total_frames())) return;
  const auto& first = *std::find_if(record.skipped.begin(), record.skipped.end(), is_unusable);
  findings.push_back(make_finding(
      "unusable-frames",
      fmt::format("{} of {} of the recording could not be used; the first: {:.6f}: {}", count,
                  counted(record.total_frames(), "frame"), first.timestamp, first.reason),
      "see what is wrong with: stillmap doctor RECORDING",
      {{"share", share(count, record.total_frames())}}));
}

/// Adds the longest gap of the trajectory, if most frames have a pose.
void add_gap(const RunDetails& record, std::vector<Finding>& findings) {
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
  findings.push_back(make_finding(
      "path-gap",
      fmt::format(
          "{} frames in a row have no pose, from {:.6f} s on ({}): the path has a gap there",
          length, longest->timestamp, longest->reason),
      "", {{"frames", static_cast<double>(length)}, {"begin_s", longest->timestamp}}));
}

void add_uncertain(const RunDetails& record, std::vector<Finding>& findings) {
  const auto& frames = record.result.frames;
  const auto uncertain = static_cast<std::size_t>(
      std::count_if(frames.begin(), frames.end(), [](const FrameRecord& f) {
        return f.has_pose() && f.uncertainty == Uncertainty::kContradiction;
      }));
  if (share(uncertain, record.result.tracked()) <= kMaxUncertain) return;
  findings.push_back(make_finding(
      "uncertain-poses",
      fmt::format("{} of {} poses contradict the motion of the camera, or the background seems to "
                  "move",
                  uncertain, record.result.tracked()),
      fmt::format("people may fill the image ({}leave out these frames), the robot itself may be "
                  "in view (--ignore FILE.png), or the intrinsics may be wrong (stillmap doctor "
                  "RECORDING)",
                  record.detector.empty() ? "give a network with --model FILE.onnx, or " : ""),
      {{"share", share(uncertain, record.result.tracked())}}));
}

void add_masks(const RunDetails& record, std::vector<Finding>& findings) {
  const SlamResult& result = record.result;
  const std::string preset = record.options.preset();
  const double without_masks = share(result.detector_failures, result.segmented);
  if (without_masks > kMaxWithoutMasks) {
    const Finding missing = make_finding(
        "masks-missing",
        fmt::format("{} of {} frames have no usable mask ({})", result.detector_failures,
                    result.segmented, result.detector_skipped),
        "name the folder of masks of this recording, in the size of its images, or a "
        "network that works",
        {{"share", without_masks}});
    const bool matters = without_masks > kMasksOfOthers || needs_detector(preset);
    findings.push_back(matters ? missing : with_severity(Severity::kWarning, missing));
  }
  if (result.detector_finding) findings.push_back(*result.detector_finding);
  if (record.detector.empty() && needs_detector(preset)) {
    findings.push_back(make_finding(
        "no-detector",
        fmt::format("preset {} got neither a network nor masks, so moving objects are tracked as "
                    "static",
                    preset),
        "name a network with --model FILE.onnx, or a folder with --masks DIR"));
  }
  if (record.detector_gives_boxes_only && needs_masks(preset)) {
    findings.push_back(make_finding(
        "boxes-only",
        fmt::format("preset {} needs masks, and the network gives boxes only, so whole boxes are "
                    "left out",
                    preset),
        "use a segmentation network such as yolov8n-seg.onnx"));
  }
}

/// Adds a dense map of next to nothing, once there are some keyframes.
void add_empty_cloud(const RunDetails& record, std::vector<Finding>& findings) {
  const SlamResult& result = record.result;
  const std::size_t points = result.dense.cloud.size();
  const bool some_frames = result.tracked() >= kFramesForACloud;
  if (!record.options.dense.enabled || result.tracked() == 0) return;
  if (result.keyframes.empty()) return;  // only localized: the cloud is that of the loaded map
  if (record.recovered && record.map && record.map->views.empty()) {
    findings.push_back(
        make_finding("empty-dense-map",
                     "the run was killed before its first view of the dense map was in the "
                     "journal, so that map is empty",
                     "stillmap run --load-map continues with the keyframes"));
    return;
  }
  if (points >= kFewestPoints || (points > 0 && !some_frames)) return;
  findings.push_back(make_finding(
      "empty-dense-map",
      "the dense map " + (points == 0 ? "is empty" : "has only " + counted(points, "point")),
      "check dense.voxel, dense.max_depth, dense.stride and dense.excluded_classes, and the depth "
      "images",
      {{"points", static_cast<double>(points)}}));
}

/// Adds a focal length that the map contradicts.
void add_wrong_focal_length(const RunDetails& record, std::vector<Finding>& findings) {
  const auto& fitting = record.result.camera_errors.focal_length;
  if (!fitting) return;
  const double factor = *fitting / record.result.camera.fx;
  if (factor < 1 / kLargestFocalFactor || factor > kLargestFocalFactor) {
    findings.push_back(make_finding(
        "focal-length",
        "the depth images contradict the map, and no focal length near the given one explains it",
        "check that depth and color are of the same camera and moment with: stillmap doctor "
        "RECORDING"));
    return;
  }
  findings.push_back(make_finding(
      "focal-length",
      fmt::format("the focal length of the camera contradicts the map: {:.0f} pixels are given, "
                  "and about {:.0f} fit better, so the map is distorted",
                  record.result.camera.fx, *fitting),
      "find the right one with: stillmap calibrate RECORDING",
      {{"given_px", record.result.camera.fx}, {"fitting_px", *fitting}}));
}

/// Adds a principal point that the map contradicts.
void add_wrong_center(const RunDetails& record, std::vector<Finding>& findings) {
  const Camera& camera = record.result.camera;
  const auto& fitting = record.result.camera_errors.center;
  if (!fitting || unlikely_camera_finding(camera)) return;
  findings.push_back(make_finding(
      "principal-point",
      fmt::format("the principal point of the camera contradicts the map: ({:.0f}, {:.0f}) is "
                  "given, and about ({:.0f}, {:.0f}) fits better, so the map is distorted",
                  camera.cx, camera.cy, fitting->x(), fitting->y()),
      "find the right one with: stillmap calibrate RECORDING",
      {{"given_cx_px", camera.cx},
       {"given_cy_px", camera.cy},
       {"fitting_cx_px", fitting->x()},
       {"fitting_cy_px", fitting->y()}}));
}

/// Adds depth images that hold distances from the camera.
void add_distances(const RunDetails& record, std::vector<Finding>& findings) {
  constexpr double kExample = 2;  // [m]
  const auto& bow = record.result.camera_errors.disparity_bow;
  if (!bow) return;
  const double corner = 1 / (1 / kExample + *bow);
  const std::string example =
      corner > kExample && corner < 5 * kExample
          ? fmt::format(" (surfaces {:.2f} m away are {:.2f} m there)", kExample, corner)
          : "";
  findings.push_back(
      make_finding("depth-is-distance",
                   "the depths grow towards the corners of the image" + example +
                       ", as if they were distances from the camera instead of depths along its "
                       "optical axis",
                   "divide them by sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2)"));
}

/// Adds that the camera was localized in the map of a place that only looks similar.
void add_another_place(const RunDetails& run, std::vector<Finding>& findings) {
  const TextureAgreement& texture = run.result.texture;
  if (!texture.of_another_place()) return;
  const double share = texture.alike / texture.regions;
  findings.push_back(make_finding(
      "another-place",
      fmt::format(
          "the camera is probably not in the place of the loaded map, but in one that looks "
          "similar: {:.0f} % of the descriptors that match are equal, 43 % or more in the "
          "same place",
          100 * share),
      "load the map of this place; if this run extended the map, discard the extended one",
      {{"share", share}}));
}

/// Adds that more than a fifth of the frames came too fast, unless the coverage is so low that
/// add_coverage() reports it.
void add_late_frames(const RunDetails& record, std::vector<Finding>& findings) {
  const std::size_t late = record.late_frames().size(), total = record.total_frames();
  const bool reported = share(record.result.tracked(), total) < kMinCoverage;
  if (reported || share(late, total) <= kMaxLate) return;
  findings.push_back(make_finding(
      "late-frames",
      fmt::format("{} of {} frames have no pose because the computer was still busy when they came",
                  late, total),
      record.dropped.empty() ? "use a lower frame rate, smaller images or a faster computer"
                             : "to use all frames of a recording: --schedule lockstep",
      {{"share", share(late, total)}}));
}

}  // namespace

std::vector<Finding> run_findings(const RunDetails& run) {
  std::vector<Finding> findings;
  add_masks(run, findings);  // a cause of the next ones
  add_coverage(run, findings);
  add_unusable(run, findings);
  add_gap(run, findings);
  add_uncertain(run, findings);
  const SlamResult& result = run.result;
  if (result.carried_parts) findings.push_back(*result.carried_parts);
  append(result.motion_sensors, findings);
  add_another_place(run, findings);
  // A run that only localizes does not need the other maps of the file.
  const std::size_t maps = result.keyframes.empty() ? result.frames_by_map.size() : result.maps;
  if (maps > 1) {
    findings.push_back(make_finding(
        "unconnected-maps",
        fmt::format("there are {} maps that are not connected, so the poses of one say nothing "
                    "about those of another",
                    maps),
        "record the places in one run, or return to the first",
        {{"maps", static_cast<double>(maps)}}));
  }
  add_empty_cloud(run, findings);
  add_wrong_focal_length(run, findings);
  add_wrong_center(run, findings);
  add_distances(run, findings);
  if (auto finding = unlikely_camera_finding(result.camera))
    findings.push_back(*std::move(finding));
  add_late_frames(run, findings);
  return findings;
}

}  // namespace stillmap
