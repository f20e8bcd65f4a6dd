// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/calibrate_recording.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/optimize/camera_calibration.hpp"
#include "stillmap/pipeline/calibrate_shutter.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/slam_system.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Maximum number of passes until the timing does not change, and of corrections of the camera.
constexpr int kMaxTimingPasses = 5, kMaxCorrections = 3;
/// Maximum number of frames whose observations are adjusted.
constexpr std::size_t kMaxPoses = 120;
/// Least number of frames and of observations that show a camera's parameters. In pieces
/// of 30 to 50 frames focal lengths were wrong by 3 to 5 standard deviations; in the pieces of
/// 60 frames and more of lab/records/real_sensors.md none is.
constexpr std::size_t kMinPoses = 58, kMinObservations = 1000;
/// Smallest corrections that are applied: 1 % of a focal length or of the image's width, since on a
/// real recording smaller ones made the poses worse (lab/records/real_sensors.md), and 4 % of a
/// depth of 4 m (0.01 / m). A parameter is observable if its standard deviation is below half of
/// that.
constexpr double kIntrinsicsBound = 0.01, kDisparityBound = 0.01;
/// Corrections of more than this many bounds are no errors of a camera (the recording shows too
/// little parallax, and its noise is fitted), unless the mean squared residual falls to this share,
/// or it is a focal length that is wrong for certain: is_wrong_focal_length(). The residual falls
/// to 0.64 to 0.70 with the right camera, since the map is adjusted as well, and to 0.28 to 0.62
/// with a focal length that is wrong by 15 %.
constexpr double kPlausibleBounds = 8, kWrongCamera = 0.55;
/// Standard deviation of the estimated timing between pieces of one recording [s]. Measured: depth
/// delays of -3 to -15 ms, since depth noise biases the estimate toward zero, and readout times of
/// 27 and 33 ms.
constexpr double kTimingScatter = 0.005;
/// Standard deviations by which a correction must differ from zero.
constexpr double kCertain = 3;

/// Keys of the parameters that a camera file holds. The slopes of the disparity error are estimated
/// as well, since the principal point would take their part, and are not corrected.
constexpr std::array<std::string_view, 6> kKeys{
    "fx", "fy", "cx", "cy", "disparity_offset", "disparity_bow"};

/// Observations of landmarks by tracked frames.
class ObservationLog {
 public:
  void add(const TrackedFrame& tracked, const PyramidShape& pyramid);
  /// Returns the problem of the frames in the component of the map that holds most of them.
  BundleProblem problem(const Map& map) const;

 private:
  struct Seen {
    KeyframeId reference;
    Pose T_reference_camera;
    std::vector<std::pair<LandmarkId, BundleObservation>> observations;
  };
  std::optional<std::uint32_t> main_component(const Map& map) const;
  std::vector<Seen> frames_;
};

void ObservationLog::add(const TrackedFrame& tracked, const PyramidShape& pyramid) {
  if (!tracked.has_pose() || !tracked.reference.valid() || tracked.tracked_by_odometry) return;
  Seen seen{tracked.reference, tracked.T_reference_camera, {}};
  const Features& features = *tracked.frame->features;
  for (std::size_t i = 0; i < tracked.landmarks.size(); ++i) {
    if (!tracked.landmarks[i].valid()) continue;
    const Keypoint& k = features.keypoints[i];
    seen.observations.push_back({tracked.landmarks[i],
                                 {.u = k.u,
                                  .v = k.v,
                                  .depth = k.depth,
                                  .scale = static_cast<float>(pyramid.scale(k.level)),
                                  .weight = tracked.frame->evidence.weight[i]}});
  }
  frames_.push_back(std::move(seen));
}

std::optional<std::uint32_t> ObservationLog::main_component(const Map& map) const {
  std::map<std::uint32_t, std::size_t> frames;
  for (const Seen& seen : frames_) {
    if (const Keyframe* keyframe = map.find(map.current_keyframe(seen.reference)))
      ++frames[keyframe->component];
  }
  const auto most =
      std::max_element(frames.begin(), frames.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == frames.end() ? std::nullopt : std::optional(most->first);
}

BundleProblem ObservationLog::problem(const Map& map) const {
  BundleProblem problem;
  problem.camera = map.camera();
  const auto component = main_component(map);
  std::map<LandmarkId, std::uint32_t> point_of;
  for (const Seen& seen : frames_) {
    const Keyframe* keyframe = map.find(map.current_keyframe(seen.reference));
    if (keyframe == nullptr || keyframe->component != component) continue;
    const auto pose = static_cast<std::uint32_t>(problem.T_world_camera.size());
    problem.T_world_camera.push_back(map.resolve(seen.reference, seen.T_reference_camera));
    problem.pose_fixed.push_back(pose == 0);
    for (auto [id, observation] : seen.observations) {
      const Landmark* landmark = map.find(id);
      if (landmark == nullptr) continue;
      const auto next = static_cast<std::uint32_t>(problem.points.size());
      const auto [known, added] = point_of.try_emplace(id, next);
      if (added) problem.points.push_back(landmark->p_world);
      observation.pose = pose;
      observation.point = known->second;
      problem.observations.push_back(observation);
    }
  }
  return problem;
}

/// Results of tracking and mapping the frames once.
struct Pass {
  ShutterTiming timing;
  /// Correction of the timing that the frames showed last, before it was applied.
  std::optional<ShutterCalibration::Correction> timing_correction;
  bool complete = false;                 ///< Whether the timing stayed the same to the last frame.
  BundleProblem problem;                 ///< Empty if not complete.
  std::optional<Finding> carried_parts;  ///< None if not complete.
};

Pass track(std::unique_ptr<FrameSource> source, const SlamParameters& parameters) {
  const std::size_t stride = source->size().value_or(0) / kMaxPoses + 1;
  Prefetch frames(std::move(source));
  SlamSystem slam(frames.camera(), parameters, nullptr);
  const ShutterTiming start = slam.shutter();
  ObservationLog log;
  Pass pass;
  while (const RgbdFramePtr frame = frames.next()) {
    slam.push(frame);
    pass.timing = slam.shutter();
    if (pass.timing != start) return pass;
    if (const auto correction = slam.shutter_calibration().correction())
      pass.timing_correction = correction;
    if (frame->index % stride == 0) log.add(*slam.newest(), parameters.orb.pyramid());
  }
  pass.timing = start;
  pass.complete = true;
  pass.carried_parts = slam.finish().carried_parts;
  pass.problem = log.problem(slam.map());
  return pass;
}

CameraVector values_of(const Camera& camera) {
  CameraVector values;
  values << camera.fx, camera.fy, camera.cx, camera.cy, camera.disparity_bias.offset,
      camera.disparity_bias.bow, 0, 0;
  return values;
}

void set_values(const CameraVector& values, Camera& camera) {
  camera.fx = values(kFx), camera.fy = values(kFy);
  camera.cx = values(kCx), camera.cy = values(kCy);
  camera.disparity_bias = {values(kDisparityOffset), values(kDisparityBow)};
}

/// Returns per parameter the smallest correction that matters.
CameraVector bounds_of(const Camera& camera) {
  CameraVector bounds;
  bounds << kIntrinsicsBound * camera.fx, kIntrinsicsBound * camera.fy,
      kIntrinsicsBound * camera.width, kIntrinsicsBound * camera.width, kDisparityBound,
      kDisparityBound, kDisparityBound, kDisparityBound;
  return bounds;
}

CalibrationVerdict verdict_of(double correction, double sigma, double bound) {
  if (!(2 * sigma < bound)) return CalibrationVerdict::kNotObservable;
  const bool certain = std::abs(correction) > std::max(kCertain * sigma, bound);
  return certain ? CalibrationVerdict::kCorrected : CalibrationVerdict::kKept;
}

/// Corrects a focal length by the ratio of the other one where only the other one is known to be
/// wrong and the given pixels are square: they stay so. Otherwise one of the given values is wrong
/// alone.
void complete_focal_lengths(CalibratedParameter& fx, CalibratedParameter& fy) {
  constexpr double kSquare = 0.02;  // largest relative difference of fx and fy
  if (std::abs(fx.given / fy.given - 1) > kSquare) return;
  const auto complete = [](CalibratedParameter& unknown, const CalibratedParameter& known) {
    if (unknown.verdict != CalibrationVerdict::kNotObservable ||
        known.verdict != CalibrationVerdict::kCorrected)
      return;
    unknown.estimated = unknown.given * known.estimated / known.given;
    unknown.sigma = unknown.given * known.sigma / known.given;
    unknown.verdict = CalibrationVerdict::kCorrected;
  };
  complete(fx, fy);
  complete(fy, fx);
}

/// Returns the corrections of the given camera.
/// @param found  those of a camera with better values
CameraCalibration from_given(const Camera& given, const Camera& camera, CameraCalibration found) {
  found.correction += values_of(camera) - values_of(given);
  return found;
}

/// @param found  corrections of the given camera
std::vector<CalibratedParameter> parameters_of(const Camera& given,
                                               const CameraCalibration& found) {
  const CameraVector values = values_of(given), bounds = bounds_of(given);
  std::vector<CalibratedParameter> parameters;
  for (std::size_t k = 0; k < kKeys.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    parameters.push_back({std::string(kKeys[k]), values(i), values(i) + found.correction(i),
                          found.sigma(i),
                          verdict_of(found.correction(i), found.sigma(i), bounds(i))});
  }
  for (const CameraParameter focal : {kFx, kFy}) {
    if (is_wrong_focal_length(given, found, focal))
      parameters[focal].verdict = CalibrationVerdict::kCorrected;
  }
  complete_focal_lengths(parameters[kFx], parameters[kFy]);
  return parameters;
}

/// Returns whether a focal length is probably far off. The map of a wrong camera is distorted; the
/// error becomes certain only in a second map, made with a better focal length.
bool is_suspect(const CalibratedParameter& p) {
  constexpr double kSuspect = 1.5, kMuch = 0.04;  // standard deviations, share
  return (p.key == "fx" || p.key == "fy") && p.verdict == CalibrationVerdict::kNotObservable &&
         std::abs(p.estimated - p.given) > std::max(kSuspect * p.sigma, kMuch * p.given);
}

/// Returns the given values with the certain corrections.
CameraVector corrected_values(const Camera& given,
                              const std::vector<CalibratedParameter>& parameters) {
  CameraVector values = values_of(given);
  for (std::size_t k = 0; k < kKeys.size(); ++k) {
    if (parameters[k].verdict == CalibrationVerdict::kCorrected)
      values(static_cast<Eigen::Index>(k)) = parameters[k].estimated;
  }
  return values;
}

/// Returns the values for the next pass: suspect focal lengths are replaced by their estimates.
CameraVector next_values(const Camera& given, const std::vector<CalibratedParameter>& parameters) {
  CameraVector values = corrected_values(given, parameters);
  for (const CameraParameter focal : {kFx, kFy}) {
    if (is_suspect(parameters[focal])) values(focal) = parameters[focal].estimated;
  }
  return values;
}

/// Returns the corrections of the given camera; without information where the observations do not
/// show them.
/// @param camera     the camera of the problem, with the best values known
/// @param discarded  gets an estimate of fx that is too far from the given value to be used
CameraCalibration errors_of(const Camera& given, const Camera& camera, const BundleProblem& problem,
                            std::optional<double>& discarded) {
  CameraCalibration unknown;
  unknown.sigma.setConstant(INFINITY);
  if (problem.T_world_camera.size() < kMinPoses || problem.observations.size() < kMinObservations)
    return unknown;
  const CameraCalibration found = calibrate_camera(problem);
  CameraCalibration total = from_given(given, camera, found);
  const CameraVector largest = kPlausibleBounds * bounds_of(camera);
  const bool plausible = (found.correction.cwiseAbs().array() <= largest.array()).all();
  const bool explains = found.variance_after < kWrongCamera * found.variance_before;
  if (plausible || explains) return total;
  for (const CameraParameter focal : {kFx, kFy}) {
    if (!is_wrong_focal_length(given, total, focal)) continue;
    unknown.correction(focal) = total.correction(focal);
    unknown.sigma(focal) = total.sigma(focal);
  }
  if (unknown.correction.isZero()) discarded = given.fx + total.correction(kFx);
  return unknown;
}

/// Adds the timing of the shutters. Either both values are corrected or none: a run estimates the
/// timing if the camera has none, and one wrong value would degrade the other.
/// @param pass the last pass in which it was estimated
void add_timing(const Camera& given, const Pass& pass, CalibrationReport& report) {
  const ShutterTiming before = given.shutter.value_or(ShutterTiming{});
  const auto correction = pass.timing_correction.value_or(
      ShutterCalibration::Correction{Eigen::Vector2d::Zero(), Eigen::Vector2d::Constant(INFINITY)});
  const Eigen::Vector2d sigma =
      (correction.sigma.array().square() + kTimingScatter * kTimingScatter).sqrt();
  const auto changes = [&](double old, double now, Eigen::Index i) {
    return now != old && std::abs(now - old) > kCertain * sigma(i);
  };
  const bool readout = changes(before.readout, pass.timing.readout, 0);
  const bool delay = changes(before.depth_delay, pass.timing.depth_delay, 1);
  const bool certain = (readout || pass.timing.readout == before.readout) &&
                       (delay || pass.timing.depth_delay == before.depth_delay);
  const auto add = [&](const char* key, double old, double now, bool changed, Eigen::Index i) {
    CalibratedParameter p{key, old, now, sigma(i), CalibrationVerdict::kNotObservable};
    if (changed && certain) p.verdict = CalibrationVerdict::kCorrected;
    if (now == old) p.estimated += correction.mean(i);
    report.parameters.push_back(p);
  };
  add("readout", before.readout, pass.timing.readout, readout, 0);
  add("depth_delay", before.depth_delay, pass.timing.depth_delay, delay, 1);
  report.camera.shutter = given.shutter;
  if (certain && (readout || delay)) report.camera.shutter = pass.timing;
}

/// Returns the effect of an error of the disparity on the depth, such as "depth reads 3.0 % short
/// at 4 m".
std::string depth_error_text(const CalibratedParameter& p) {
  constexpr double kDepth = 4;  // depth at which the error is told [m]
  const double share = 1 / (1 + (p.estimated - p.given) * kDepth) - 1;
  return fmt::format("depth reads {:.1f} % {} at {:g} m", 100 * std::abs(share),
                     share < 0 ? "short" : "long", kDepth);
}

}  // namespace

CalibrationReport calibrate_recording(
    const std::function<std::unique_ptr<FrameSource>(const Camera& recorded)>& open,
    const Camera& recorded, const SlamParameters& parameters) {
  const TraceScope scope("calibration of the recording");
  SlamParameters mapping = tracking_only(parameters);
  Camera camera = recorded;  // with the best values known so far
  Pass timed = track(open(camera), mapping);
  for (int i = 1; !timed.complete && i < kMaxTimingPasses; ++i) {
    mapping.tracker.shutter = timed.timing;
    timed = track(open(camera), mapping);
  }
  // From here on the timing stays the same.
  camera.shutter = timed.timing;
  Pass pass = timed.complete ? timed : track(open(camera), mapping);
  CalibrationReport report;
  for (int corrections = 0;; ++corrections) {
    const CameraCalibration found =
        errors_of(recorded, camera, pass.problem, report.discarded_focal_length);
    report.parameters = parameters_of(recorded, found);
    const CameraVector before = values_of(camera);
    set_values(next_values(recorded, report.parameters), camera);
    const CameraVector change = (values_of(camera) - before).cwiseAbs();
    const bool settled = (change.array() <= found.sigma.array()).all();
    if (settled || corrections == kMaxCorrections) break;
    pass = track(open(camera), mapping);
  }
  report.frames = pass.problem.T_world_camera.size();
  report.observations = pass.problem.observations.size();
  report.carried_parts = pass.carried_parts;
  report.camera = camera;
  set_values(corrected_values(recorded, report.parameters), report.camera);
  add_timing(recorded, timed, report);
  return report;
}

bool shows_focal_length(const CalibrationReport& report) {
  return std::any_of(report.parameters.begin(), report.parameters.end(), [](const auto& p) {
    return (p.key == "fx" || p.key == "fy") && p.verdict != CalibrationVerdict::kNotObservable;
  });
}

bool shows_wrong_intrinsics(const CalibrationReport& report) {
  return std::any_of(report.parameters.begin(), report.parameters.end(), [&](const auto& p) {
    const bool intrinsic = p.key == "fx" || p.key == "fy" || p.key == "cx" || p.key == "cy";
    return intrinsic && p.verdict == CalibrationVerdict::kCorrected &&
           is_wrong_intrinsic(p.estimated - p.given, p.sigma, report.camera.fx);
  });
}

std::vector<std::string> calibration_findings(const CalibrationReport& report) {
  std::vector<std::string> findings;
  for (const CalibratedParameter& p : report.parameters) {
    if (p.verdict != CalibrationVerdict::kCorrected) continue;
    if (p.key == "disparity_offset") {
      findings.push_back(depth_error_text(p));
    } else if (p.key == "disparity_bow") {
      findings.push_back(depth_error_text(p) +
                         " in the corners of the image, compared with its center");
    } else if (p.key == "readout") {
      findings.push_back(
          fmt::format("readout is {:.1f} +- {:.1f} ms", 1000 * p.estimated, 1000 * p.sigma));
    } else if (p.key == "depth_delay") {
      findings.push_back(fmt::format(
          "depth_delay is {:.1f} ms or more (noise of the depth draws the estimate towards zero)",
          1000 * p.estimated));
    } else {
      findings.push_back(
          fmt::format("intrinsics disagree with the depth: {} {:.1f} +- {:.1f} "
                      "pixels estimated, {:.1f} given",
                      p.key, p.estimated, p.sigma, p.given));
    }
  }
  return findings;
}

}  // namespace stillmap
