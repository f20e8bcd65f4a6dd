// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/trajectory_error.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/only_positions.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/geometry/association.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Timestamps with this difference or more do not pair [s], as in the benchmark's own tool.
constexpr double kMaxDifference = 0.02;

/// Share of the poses with a true pose below which the text tells it.
constexpr double kFewPairs = 0.9;

std::vector<double> stamps_of(const Trajectory& trajectory) {
  std::vector<double> stamps(trajectory.size());
  std::transform(trajectory.begin(), trajectory.end(), stamps.begin(),
                 [](const StampedPose& pose) { return pose.timestamp; });
  return stamps;
}

std::vector<double> intervals(std::span<const double> stamps) {
  std::vector<double> result;
  for (std::size_t i = 1; i < stamps.size(); ++i) result.push_back(stamps[i] - stamps[i - 1]);
  return result;
}

/// Returns the index of the timestamp nearest to t [s], by bisection; the first visited wins a tie.
/// The timestamps are sorted and not empty.
std::size_t nearest(std::span<const double> stamps, double t) {
  std::size_t best = 0, first = 0, last = stamps.size();
  while (first < last) {
    const std::size_t middle = (first + last) / 2;
    if (std::abs(stamps[middle] - t) < std::abs(stamps[best] - t)) best = middle;
    if (stamps[middle] == t) break;
    if (stamps[middle] > t) {
      last = middle;
    } else {
      first = middle + 1;
    }
  }
  return best;
}

std::string time_span(const Trajectory& trajectory) {
  return fmt::format("{:.6f} to {:.6f} s ({})", trajectory.front().timestamp,
                     trajectory.back().timestamp, counted(trajectory.size(), "pose"));
}

void require_poses(const Trajectory& truth, const Trajectory& estimate, std::size_t least) {
  const auto require = [least](const Trajectory& trajectory, const std::string& name) {
    if (trajectory.size() >= least) return;
    throw Error(fmt::format("has {}, fewer than {}", counted(trajectory.size(), "pose"), least),
                name, "check that tracking gave poses and that the right file was named");
  };
  require(truth, "true trajectory");
  require(estimate, "estimated trajectory");
}

[[noreturn]] void throw_too_few_pairs(const Trajectory& truth, const Trajectory& estimate,
                                      std::size_t pairs) {
  const bool overlap = estimate.front().timestamp < truth.back().timestamp + kMaxDifference &&
                       truth.front().timestamp < estimate.back().timestamp + kMaxDifference;
  throw Error(
      overlap ? fmt::format("only {} of stamps are within {} s of each other; 3 are needed",
                            counted(pairs, "pair"), kMaxDifference)
              : std::string("the two trajectories do not overlap in time"),
      fmt::format("truth {}, estimate {}", time_span(truth), time_span(estimate)),
      "check that both files belong to the same recording and count seconds on the same clock");
}

Eigen::Matrix3Xd positions_of(const std::vector<AtePair>& pairs, Eigen::Vector3d AtePair::*member) {
  Eigen::Matrix3Xd positions(3, static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    positions.col(static_cast<Eigen::Index>(i)) = pairs[i].*member;
  }
  return positions;
}

/// Returns the pairs in order of their timestamps, before alignment.
std::vector<AtePair> associate_poses(const Trajectory& truth, const Trajectory& estimate) {
  std::vector<AtePair> pairs;
  for (const auto& [i, j] : associate(stamps_of(truth), stamps_of(estimate), kMaxDifference)) {
    pairs.push_back({estimate[j].timestamp, truth[i].timestamp,
                     truth[i].T_world_camera.translation(),
                     estimate[j].T_world_camera.translation(), 0});
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return pairs;
}

/// Returns rotation, translation and scale of the similarity that aligns b to a (Umeyama 1991).
std::pair<Pose, double> similarity(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  const Eigen::Matrix4d T = Eigen::umeyama(b, a, true);
  const double scale = std::cbrt(T.topLeftCorner<3, 3>().determinant());
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>() / scale;
  return {Pose(R, T.topRightCorner<3, 1>()), scale};
}

/// Sets the alignment of the paired positions.
void align(const AteOptions& options, AteResult& result) {
  const Eigen::Matrix3Xd truth = positions_of(result.pairs, &AtePair::p_truth);
  const Eigen::Matrix3Xd estimate = positions_of(result.pairs, &AtePair::p_estimate);
  if (options.T_truth_estimate) {
    result.T_truth_estimate = *options.T_truth_estimate;
  } else if (options.with_scale) {
    std::tie(result.T_truth_estimate, result.scale) = similarity(truth, estimate);
  } else {
    result.T_truth_estimate = align_points(truth, estimate);
  }
}

/// Returns the motion from pose j to pose i in the frame of j: T_j^-1 T_i.
Pose motion(const Trajectory& trajectory, std::size_t i, std::size_t j) {
  return trajectory[j].T_world_camera.inverse() * trajectory[i].T_world_camera;
}

double rotation_degrees(const Pose& T) {
  const double cosine = std::clamp((T.rotation().trace() - 1) / 2, -1.0, 1.0);
  return std::acos(cosine) * 180 / std::numbers::pi;
}

/// Returns the indices (i, j) of the estimate's poses that are one second or one pose apart.
std::vector<std::pair<std::size_t, std::size_t>> fixed_delta_pairs(std::span<const double> stamps,
                                                                   RpeDelta delta) {
  std::vector<double> clock(stamps.begin(), stamps.end());
  if (delta == RpeDelta::kFrame) std::iota(clock.begin(), clock.end(), 0.0);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < clock.size(); ++i) {
    const std::size_t j = nearest(clock, clock[i] + 1);
    if (j + 1 != clock.size()) pairs.emplace_back(i, j);
  }
  return pairs;
}

/// Returns a number of at most 8 characters, if it is below 10 million.
std::string seven_digits(double value) {
  const int digits = std::abs(value) < 1 ? 1 : 1 + static_cast<int>(std::log10(std::abs(value)));
  return fmt::format("{:.{}f}", value, std::clamp(7 - digits, 0, 6));
}

template <typename Pair>
Statistics statistics_of(const std::vector<Pair>& pairs, double Pair::*member) {
  std::vector<double> errors(pairs.size());
  std::transform(pairs.begin(), pairs.end(), errors.begin(),
                 [member](const Pair& pair) { return pair.*member; });
  return compute_statistics(errors);
}

/// Returns the errors of all pairs that are delta apart; there may be none.
RpeResult errors_over(const Trajectory& truth, const Trajectory& estimate, RpeDelta delta) {
  require_poses(truth, estimate, 2);
  const Trajectory gt = one_pose_per_stamp(truth), est = one_pose_per_stamp(estimate);
  require_poses(gt, est, 2);
  const std::vector<double> gt_stamps = stamps_of(gt), est_stamps = stamps_of(est);
  const double max_gap = 2 * quantile(intervals(gt_stamps), 0.5);

  RpeResult result;
  for (const auto& [i, j] : fixed_delta_pairs(est_stamps, delta)) {
    const std::size_t gt_i = nearest(gt_stamps, est_stamps[i]);
    const std::size_t gt_j = nearest(gt_stamps, est_stamps[j]);
    if (std::abs(gt_stamps[gt_i] - est_stamps[i]) > max_gap) continue;
    if (std::abs(gt_stamps[gt_j] - est_stamps[j]) > max_gap) continue;
    const Pose A = motion(gt, gt_i, gt_j), B = motion(est, i, j);
    const Pose E = B.inverse() * A;
    result.pairs.push_back(
        {est_stamps[i], est_stamps[j], E.translation().norm(), rotation_degrees(E)});
  }
  result.translation = statistics_of(result.pairs, &RpePair::translation);
  result.rotation = statistics_of(result.pairs, &RpePair::rotation);
  return result;
}

}  // namespace

Trajectory one_pose_per_stamp(Trajectory trajectory) {
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  Trajectory unique;
  for (const StampedPose& pose : trajectory) {
    if (!unique.empty() && unique.back().timestamp == pose.timestamp) unique.pop_back();
    unique.push_back(pose);
  }
  return unique;
}

double Coverage::share() const {
  if (total == 0) return 0;
  return std::min(1.0, static_cast<double>(tracked) / static_cast<double>(total));
}

Coverage compute_coverage(const Trajectory& estimate, std::size_t total_frames) {
  return {one_pose_per_stamp(estimate).size(), total_frames, false};
}

Coverage estimate_coverage(const Trajectory& estimate, const Trajectory& truth) {
  const std::vector<double> stamps = stamps_of(one_pose_per_stamp(estimate));
  const std::vector<double> true_stamps = stamps_of(one_pose_per_stamp(truth));
  std::size_t total = stamps.size();
  if (stamps.size() >= 2 && true_stamps.size() >= 2) {
    const double frames =
        (true_stamps.back() - true_stamps.front()) / quantile(intervals(stamps), 0.5);
    total = std::max(total, static_cast<std::size_t>(std::llround(frames)) + 1);
  }
  return {stamps.size(), total, true};
}

AteResult absolute_trajectory_error(const Trajectory& truth, const Trajectory& estimate,
                                    const AteOptions& options) {
  require_poses(truth, estimate, 1);
  const Trajectory gt = one_pose_per_stamp(truth), est = one_pose_per_stamp(estimate);
  AteResult result;
  result.pairs = associate_poses(gt, est);
  if (result.pairs.size() < 3) throw_too_few_pairs(gt, est, result.pairs.size());
  align(options, result);
  for (AtePair& pair : result.pairs) {
    pair.p_estimate = result.T_truth_estimate * (result.scale * pair.p_estimate);
    pair.error = (pair.p_estimate - pair.p_truth).norm();
  }
  result.translation = statistics_of(result.pairs, &AtePair::error);
  return result;
}

RpeResult relative_pose_error(const Trajectory& truth, const Trajectory& estimate, RpeDelta delta) {
  RpeResult result = errors_over(truth, estimate, delta);
  if (result.pairs.empty()) {
    throw Error(fmt::format("no two poses 1 {} apart have a true pose near enough",
                            delta == RpeDelta::kSecond ? "s" : "frame"),
                fmt::format("truth {}, estimate {}", time_span(one_pose_per_stamp(truth)),
                            time_span(one_pose_per_stamp(estimate))),
                "check that both belong to the same recording");
  }
  return result;
}

DisplacementResult displacement_error(const Trajectory& truth, const Trajectory& estimate,
                                      const Pose& T_truth_estimate) {
  const Trajectory gt = one_pose_per_stamp(truth), est = one_pose_per_stamp(estimate);
  const double max_interval = 1.5 * quantile(intervals(stamps_of(est)), 0.5);
  DisplacementResult result;
  std::vector<double> errors, true_lengths, lengths;
  double largest = -1;  // step so far [m]
  for (std::size_t i = 1; i < est.size(); ++i) {
    if (est[i].timestamp - est[i - 1].timestamp > max_interval) continue;
    const Eigen::Vector3d moved =
        T_truth_estimate.quaternion() *
        (est[i].T_world_camera.translation() - est[i - 1].T_world_camera.translation());
    if (moved.norm() > largest) {
      largest = moved.norm();
      result.largest_step_at = est[i].timestamp;
    }
    lengths.push_back(moved.norm());
    const auto before = pose_at(gt, est[i - 1].timestamp), after = pose_at(gt, est[i].timestamp);
    if (!before || !after) continue;
    const Eigen::Vector3d truly = after->translation() - before->translation();
    true_lengths.push_back(truly.norm());
    errors.push_back((moved - truly).norm());
  }
  result.error = compute_statistics(errors);
  result.truth = compute_statistics(true_lengths);
  result.estimate = compute_statistics(lengths);
  return result;
}

Evaluation evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                               const EvaluationOptions& options) {
  Evaluation result;
  result.ate = absolute_trajectory_error(truth, estimate, options.ate);
  result.world = options.ate.T_truth_estimate
                     ? WorldAlignment{WorldAlignment::By::kGiven, options.ate.T_truth_estimate}
                     : align_worlds(truth, estimate, result.ate);
  if (options.with_scale) {
    AteOptions with_scale = options.ate;
    with_scale.with_scale = true;
    result.ate_with_scale = absolute_trajectory_error(truth, estimate, with_scale);
  }
  result.displacement = displacement_error(truth, estimate, result.ate.T_truth_estimate);
  result.only_positions = has_only_positions(truth, estimate);
  if (!result.only_positions) {
    result.rpe = errors_over(truth, estimate, RpeDelta::kSecond);
    if (options.per_frame)
      result.rpe_frame = relative_pose_error(truth, estimate, RpeDelta::kFrame);
  }
  result.coverage = options.total_frames ? compute_coverage(estimate, *options.total_frames)
                                         : estimate_coverage(estimate, truth);
  return result;
}

std::string evaluation_text(const Evaluation& evaluation) {
  std::string text = fmt::format("{:<16}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>7}\n", "", "rmse", "mean",
                                 "median", "sd", "min", "max", "pairs");
  const char* no_pairs = evaluation.only_positions ? "one of the files has no rotations"
                                                   : "no two poses are that far apart";
  const auto line = [&](const char* name, const Statistics& s) {
    if (s.count == 0) {
      text += fmt::format("{:<16}none: {}\n", name, no_pairs);
      return;
    }
    text += fmt::format("{:<16}", name);
    for (const double value : {s.rmse, s.mean, s.median, s.sd, s.min, s.max})
      text += fmt::format("{:>9}", seven_digits(value));
    text += fmt::format("{:>7}\n", s.count);
  };
  line("ATE [m]", evaluation.ate.translation);
  if (evaluation.ate_with_scale) line("ATE, Sim(3) [m]", evaluation.ate_with_scale->translation);
  line("RPE 1 s [m]", evaluation.rpe.translation);
  line("RPE 1 s [deg]", evaluation.rpe.rotation);
  if (evaluation.rpe_frame) {
    line("RPE frame [m]", evaluation.rpe_frame->translation);
    line("RPE frame [deg]", evaluation.rpe_frame->rotation);
  }
  if (evaluation.displacement.error.count > 0) {
    line("step error [m]", evaluation.displacement.error);
    line("true step [m]", evaluation.displacement.truth);
  }
  const Statistics& steps = evaluation.displacement.estimate;
  text += fmt::format("largest step from frame to frame {:.4f} m at {:.6f} s\n", steps.max,
                      evaluation.displacement.largest_step_at);
  if (evaluation.ate_with_scale) {
    text +=
        fmt::format("scale of the estimate for Sim(3) {:.4f}\n", evaluation.ate_with_scale->scale);
  }
  const Coverage& coverage = evaluation.coverage;
  text += fmt::format("coverage {}/{} frames = {:.1f} %{}\n", coverage.tracked, coverage.total,
                      100 * coverage.share(),
                      coverage.estimated ? " (total estimated from the truth's time span)" : "");
  const std::size_t pairs = evaluation.ate.pairs.size();
  if (static_cast<double>(pairs) < kFewPairs * static_cast<double>(coverage.tracked))
    text += fmt::format("only {} of {} poses have a true pose: the errors are of these alone\n",
                        pairs, coverage.tracked);
  return text;
}

void to_json(nlohmann::json& json, const Coverage& coverage) {
  json = {{"tracked", coverage.tracked},
          {"total", coverage.total},
          {"share", coverage.share()},
          {"total_is_estimated", coverage.estimated}};
}

void to_json(nlohmann::json& json, const AteResult& ate) {
  const Eigen::Quaterniond& q = ate.T_truth_estimate.quaternion();
  const Eigen::Vector3d& t = ate.T_truth_estimate.translation();
  json = {{"translation_m", ate.translation},
          {"pairs", ate.pairs.size()},
          {"scale", ate.scale},
          {"T_truth_estimate",
           {{"translation_m", {t.x(), t.y(), t.z()}},
            {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}};
}

void to_json(nlohmann::json& json, const RpeResult& rpe) {
  json = {{"translation_m", rpe.translation},
          {"rotation_deg", rpe.rotation},
          {"pairs", rpe.pairs.size()}};
}

void to_json(nlohmann::json& json, const DisplacementResult& displacement) {
  json = {{"error_m", displacement.error},
          {"truth_m", displacement.truth},
          {"estimate_m", displacement.estimate},
          {"largest_step_at_s", displacement.largest_step_at}};
}

void to_json(nlohmann::json& json, const Evaluation& evaluation) {
  json = {{"ate", evaluation.ate},
          {"rpe_1s", nullptr},
          {"only_positions", evaluation.only_positions},
          {"alignment_of_maps", evaluation.world},
          {"displacement", evaluation.displacement},
          {"coverage", evaluation.coverage}};
  if (evaluation.ate_with_scale) json["ate_with_scale"] = *evaluation.ate_with_scale;
  if (!evaluation.rpe.pairs.empty()) json["rpe_1s"] = evaluation.rpe;
  if (evaluation.rpe_frame) json["rpe_frame"] = *evaluation.rpe_frame;
}

}  // namespace stillmap
