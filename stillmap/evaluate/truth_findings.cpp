// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/truth_findings.hpp"

#include "stillmap/evaluate/only_positions.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/evaluate/truth_frame.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Median rotation errors over one second below this are those of tracking [degrees].
constexpr double kAgreement = 0.5;
/// The same for difference().
constexpr double kDifference = 1;
/// Ratio of two differences from which the larger is that of a wrong reading. A wrong order or
/// frame gives errors of the size of the motion itself.
constexpr double kRatio = 3;
/// Ratio of a rotation to its error from which truth and estimate turn alike.
constexpr double kSameTurn = 5;
/// Ratio of two displacements that are not of one unit, and a displacement over one second that no
/// camera has [m].
constexpr double kOtherUnit = 1.8, kFastest = 50;
/// Displacement over one second below which it is that of drift [m].
constexpr double kLeastSeenWay = 0.01;
/// Motions with an error of this share of their size have hardly anything in common: unrelated
/// motions of one size have at least 1.
constexpr double kUnrelated = 0.8;
/// Share from which the order of the numbers or the frame of the poses may be another one, and up
/// to which another reading agrees.
constexpr double kUnlike = 0.3;
/// Median motion over one second below which nothing is told.
constexpr double kLeastTurn = 2, kLeastWay = 0.05;  // [degrees], [m]
constexpr std::size_t kMostMotions = 500;           // spread evenly over the estimate
constexpr double kLeastDelay = 0.1, kLargestDelay = 3, kDelayStep = 0.05;  // [s]

/// Shortest time from the first to the last of the motions by which another body is recognized [s]:
/// those of one turn have one axis, and its error.
constexpr double kLeastSpan = 2;

/// A motion of the camera over one second, in the frame of its beginning.
struct Motion {
  Pose truth, estimate;
  double begin = 0;  ///< Timestamp [s].
};

/// Median sizes of motions and of their differences, rotations in degrees, displacements in meters.
struct Sizes {
  double true_turn = 0, turn = 0;  ///< Angles of the rotations.
  double turn_error = 0;           ///< Angles of the rotations between truth and estimate.
  double angle_error = 0;          ///< Differences of the angles.
  double true_way = 0, way = 0;    ///< Lengths of the displacements.
  double way_error = 0;            ///< Lengths of the differences of the displacements.
  double length_error = 0;         ///< Differences of the lengths.
};

/// Another way to read the files.
struct Reading {
  Trajectory truth, estimate;
  std::string condition;  // "and by 0.1 degrees CONDITION"
  std::string fix;
};

double degrees(const Pose& T) { return T.angle() * 180 / std::numbers::pi; }

/// Returns at most kMostMotions motions whose ends have a true pose.
/// @param delay  time that the truth's clock is ahead of the estimate's [s]
std::vector<Motion> motions(const Trajectory& truth, const Trajectory& estimate, double delay = 0) {
  std::vector<Motion> result;
  const std::size_t step = estimate.size() / kMostMotions + 1;
  for (std::size_t i = 0; i < estimate.size(); i += step) {
    const auto& [begin, T_begin] = estimate[i];
    const auto end = std::lower_bound(
        estimate.begin(), estimate.end(), begin + 1,
        [](const StampedPose& pose, double timestamp) { return pose.timestamp < timestamp; });
    if (end == estimate.end()) break;
    const auto true_begin = pose_at(truth, begin + delay);
    const auto true_end = pose_at(truth, end->timestamp + delay);
    if (!true_begin || !true_end) continue;
    result.push_back(
        {true_begin->inverse() * *true_end, T_begin.inverse() * end->T_world_camera, begin});
  }
  return result;
}

/// Returns the median of a figure of the motions; there is at least one.
double median(const std::vector<Motion>& motions,
              const std::function<double(const Motion&)>& figure) {
  std::vector<double> values(motions.size());
  std::transform(motions.begin(), motions.end(), values.begin(), figure);
  return quantile(values, 0.5);
}

double way_error(const Motion& m) {
  return (m.truth.translation() - m.estimate.translation()).norm();
}

double turn_error(const Motion& m) { return degrees(m.estimate.inverse() * m.truth); }

Sizes sizes(const std::vector<Motion>& motions) {
  const auto length = [](const Pose& T) { return T.translation().norm(); };
  const auto median_of = [&](const auto& figure) { return median(motions, figure); };
  return {.true_turn = median_of([](const Motion& m) { return degrees(m.truth); }),
          .turn = median_of([](const Motion& m) { return degrees(m.estimate); }),
          .turn_error = median_of(turn_error),
          .angle_error = median_of(
              [](const Motion& m) { return std::abs(degrees(m.truth) - degrees(m.estimate)); }),
          .true_way = median_of([&](const Motion& m) { return length(m.truth); }),
          .way = median_of([&](const Motion& m) { return length(m.estimate); }),
          .way_error = median_of(way_error),
          .length_error = median_of(
              [&](const Motion& m) { return std::abs(length(m.truth) - length(m.estimate)); })};
}

/// Returns the poses with quaternions whose numbers were qw qx qy qz in the file.
Trajectory with_qw_first(const Trajectory& trajectory) {
  Trajectory result = trajectory;
  for (StampedPose& pose : result) {
    const Eigen::Quaterniond& q = pose.T_world_camera.quaternion();
    pose.T_world_camera =
        Pose(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), pose.T_world_camera.translation());
  }
  return result;
}

Trajectory inverted(Trajectory trajectory) {
  for (StampedPose& pose : trajectory) pose.T_world_camera = pose.T_world_camera.inverse();
  return trajectory;
}

/// Returns the poses with inverse rotations and the same positions.
Trajectory with_inverse_rotations(Trajectory trajectory) {
  for (StampedPose& pose : trajectory) {
    const Pose& T = pose.T_world_camera;
    pose.T_world_camera = Pose(T.quaternion().conjugate(), T.translation());
  }
  return trajectory;
}

/// Returns the poses of cameras that are turned by an angle about an axis of their frame.
Trajectory of_turned_cameras(const Trajectory& trajectory, int degrees,
                             const Eigen::Vector3d& axis) {
  const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180, axis);
  return in_camera_frame(trajectory,
                         {Pose(), Pose(Eigen::Quaterniond(turn), Eigen::Vector3d::Zero())});
}

/// Returns the poses in the file of the truth.
Trajectory without_frame(const Trajectory& camera, const TruthFrame& frame) {
  return in_camera_frame(camera,
                         {frame.T_world_reference.inverse(), frame.T_body_camera.inverse()});
}

std::vector<Reading> other_readings(const Trajectory& truth, const Trajectory& estimate,
                                    const TrajectoryNames& names) {
  const std::string both = "both files";
  const TruthFrame frame =
      names.truth_frame.empty() ? TruthFrame() : read_truth_frame(names.truth_frame);
  const Trajectory in_file = without_frame(truth, frame);
  std::vector<Reading> readings;
  const auto add = [&](const std::function<Trajectory(const Trajectory&)>& read_as,
                       const std::string& condition, const std::string& fix) {
    const Trajectory other_truth = in_camera_frame(read_as(in_file), frame);
    const Trajectory other_estimate = read_as(estimate);
    for (const auto& [file, of_truth, of_estimate] :
         {std::tuple(names.estimate, &truth, &other_estimate),
          std::tuple(names.truth, &other_truth, &estimate),
          std::tuple(both, &other_truth, &other_estimate)}) {
      if (names.estimate_is_own && of_estimate != &estimate) continue;
      readings.push_back({*of_truth, *of_estimate, fmt::format(fmt::runtime(condition), file),
                          fmt::format(fmt::runtime(fix), file == both ? "each of them" : file)});
    }
  };
  add(with_qw_first, "if the quaternions of {} are read as qw qx qy qz",
      "write the order of TUM, qx qy qz qw: awk '!/^#/ {{print $1,$2,$3,$4,$6,$7,$8,$5}}' {}");
  add(inverted, "if the poses of {} are inverted",
      "write T_world_camera, the pose of the camera in the world, to {}");
  add(with_inverse_rotations, "if the quaternions of {} are inverted",
      "write the rotation from the camera to the world to {}");
  const auto add_turned = [&](int degrees, const Eigen::Vector3d& axis, const std::string& how,
                              const std::string& fix) {
    readings.push_back({of_turned_cameras(truth, degrees, axis), estimate,
                        fmt::format("if the cameras of {} are turned {}", names.truth, how), fix});
  };
  add_turned(180, Eigen::Vector3d::UnitX(), "to the axes of OpenGL or back (y up, z backward)",
             "write both with one convention: OpenCV's is x right, y down, z forward");
  for (const int degrees : {90, 180, 270})
    add_turned(degrees, Eigen::Vector3d::UnitZ(),
               fmt::format("by {} degrees about the optical axis", degrees),
               "write both of the same images: --rotate turns the camera with its images");
  if (names.truth_frame.empty())
    readings.push_back({in_camera_frame(truth, read_truth_frame("bonn")), estimate,
                        "with --truth-frame bonn", "give --truth-frame bonn"});
  else
    readings.push_back({in_file, estimate, "without --truth-frame " + names.truth_frame,
                        "leave it out: the truth is already the pose of the camera"});
  return readings;
}

/// Which errors of the motions tell something.
struct Scope {
  bool only_positions = false;  ///< One of the trajectories has no rotations.
  bool scale_is_known = true;
};

constexpr double kPerMeter = 100;  // degrees of rotation that count as a displacement of 1 m

/// Returns how much truth and estimate differ over one second: degrees, and centimeters.
double difference(const Sizes& s, const Scope& scope) {
  if (scope.only_positions) return kPerMeter * s.length_error;
  return s.turn_error + (scope.scale_is_known ? kPerMeter * s.way_error : 0);
}

/// Returns the size of the motions in the units of difference().
double total(const Sizes& s, const Scope& scope) {
  const double way = kPerMeter * std::max(s.true_way, s.way);
  if (scope.only_positions) return way;
  return std::max(s.true_turn, s.turn) + (scope.scale_is_known ? way : 0);
}

std::string difference_text(const Sizes& s, const Scope& scope) {
  if (scope.only_positions) return fmt::format("{:.2g} m", s.length_error);
  return fmt::format("{:.2g} degrees and {:.2g} m", s.turn_error, s.way_error);
}

/// The best other reading.
struct BestReading {
  double difference = 0;
  std::string differs_by, condition, fix;
};

/// Returns the reading with the least difference, if it is far below that as read. Another order or
/// frame is only tried if the motions differ by a large part of their size.
std::optional<BestReading> best_reading(const Trajectory& truth, const Trajectory& estimate,
                                        const TrajectoryNames& names, const Scope& scope,
                                        const Sizes& as_read) {
  const double bound = difference(as_read, scope) / kRatio;
  const double turn_bound = std::max(kAgreement, as_read.turn_error / kRatio);
  std::optional<BestReading> best;
  const auto consider = [&](const std::vector<Motion>& motions, const std::string& condition,
                            const std::string& fix) {
    if (motions.empty()) return;
    const Sizes size = sizes(motions);
    const double differs = difference(size, scope);
    const bool turns_agree = scope.only_positions || size.turn_error <= turn_bound;
    const bool agrees = turns_agree && differs <= kUnlike * total(size, scope);
    if (agrees && differs < (best ? best->difference : bound))
      best = {differs, difference_text(size, scope), condition, fix};
  };
  if (!scope.only_positions && difference(as_read, scope) > kUnlike * total(as_read, scope)) {
    for (const Reading& reading : other_readings(truth, estimate, names))
      consider(motions(reading.truth, reading.estimate), reading.condition, reading.fix);
  }
  for (double late = kLeastDelay; late <= kLargestDelay; late += kDelayStep) {
    for (const double delay : {late, -late}) {
      consider(motions(truth, estimate, delay),
               fmt::format("if the times of {} are made {:.2f} s {}", names.truth, std::abs(delay),
                           delay > 0 ? "earlier" : "later"),
               "give both trajectories the clock of the images");
    }
  }
  return best;
}

/// The factor by which the estimated displacements fit the true ones best, and the median error
/// that is left [m].
struct ScaleFit {
  double factor = 0, left = 0;
};

ScaleFit scale_fit(const std::vector<Motion>& motions, bool only_positions) {
  double product = 0, square = 0;
  for (const Motion& m : motions) {
    const Eigen::Vector3d &a = m.truth.translation(), &b = m.estimate.translation();
    product += only_positions ? a.norm() * b.norm() : a.dot(b);
    square += b.squaredNorm();
  }
  ScaleFit fit;
  fit.factor = square > 0 ? product / square : 0;
  fit.left = median(motions, [&](const Motion& m) {
    const Eigen::Vector3d &a = m.truth.translation(), &b = m.estimate.translation();
    return only_positions ? std::abs(a.norm() - fit.factor * b.norm())
                          : (a - fit.factor * b).norm();
  });
  return fit;
}

/// Returns the position of the body whose pose the truth is in the frame of the camera, if the
/// displacements differ as those of two points of one body do: by (R - I) p for a motion with the
/// rotation R. Least squares.
std::optional<Eigen::Vector3d> lever_arm(const std::vector<Motion>& motions, const Sizes& size) {
  constexpr double kLeast = 0.03, kMost = 1;  // distances of a marker or robot from its camera [m]
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  const auto lever = [](const Motion& m) -> Eigen::Matrix3d {
    return m.estimate.rotation() - Eigen::Matrix3d::Identity();
  };
  const auto apart = [](const Motion& m) -> Eigen::Vector3d {
    return m.truth.translation() - m.estimate.translation();
  };
  for (const Motion& m : motions) {
    A += lever(m).transpose() * lever(m);
    b += lever(m).transpose() * apart(m);
  }
  Eigen::Vector3d p = A.completeOrthogonalDecomposition().solve(b);
  const double left =
      median(motions, [&](const Motion& m) { return (apart(m) - lever(m) * p).norm(); });
  if (p.norm() < kLeast || p.norm() > kMost || left > size.way_error / kRatio) return std::nullopt;
  return p;
}

/// Returns what motions that no other reading explains have in common.
std::optional<Finding> finding_of_motions(const std::vector<Motion>& motions, const Sizes& s,
                                          const TrajectoryNames& names, const Scope& scope) {
  const double turn = std::max(s.true_turn, s.turn), way = std::max(s.true_way, s.way);
  const bool turns = turn >= kLeastTurn && !scope.only_positions, moves = way >= kLeastWay;
  const double way_error = scope.only_positions ? s.length_error : s.way_error;
  const std::string between = fmt::format("{} and {}", names.estimate, names.truth);
  const bool shows_bodies = motions.back().begin - motions.front().begin >= kLeastSpan;
  if (shows_bodies && turns && s.turn_error >= kAgreement &&
      s.angle_error <= s.turn_error / kSameTurn)
    return make_finding(
        "truth-body",
        fmt::format("{} turn by the same angles over 1 s (median {:.3g} degrees, difference "
                    "{:.2g}), but about other axes ({:.3g} degrees apart): one of them is the pose "
                    "of another body than the camera",
                    between, s.true_turn, s.angle_error, s.turn_error),
        "name its frame by --truth-frame");
  const std::string advice =
      "either the truth is that of another recording, or tracking failed: give the truth of this "
      "recording or look at the report";
  const bool ways_agree = moves && s.way_error < way / 2;
  if (turns && !ways_agree && s.turn_error >= kUnrelated * turn)
    return make_finding(
        "truth-unrelated",
        fmt::format("the rotations of {} have hardly anything in common: {:.3g} and {:.3g} degrees "
                    "over 1 s (median), and {:.3g} apart",
                    between, s.turn, s.true_turn, s.turn_error),
        advice);
  if (!moves || !scope.scale_is_known) return std::nullopt;
  const bool turns_agree =
      scope.only_positions || s.turn_error <= std::max(kAgreement, turn / kSameTurn);
  const ScaleFit scale = scale_fit(motions, scope.only_positions);
  const bool is_scaled = scale.left <= way_error / kRatio;
  const double ratio = std::max(scale.factor, 1 / scale.factor);
  const bool is_drift = std::min(s.true_way, s.way) < kLeastSeenWay && way < 1;
  if (way > kFastest || (turns_agree && is_scaled && ratio > kOtherUnit && !is_drift))
    return make_finding("truth-unit",
                        fmt::format("the camera moves by {:.3g} m over 1 s in {} and by {:.3g} m "
                                    "in {} (median)",
                                    s.way, names.estimate, s.true_way, names.truth),
                        "write both in meters, or check the depth factor",
                        {{"estimate_m", s.way}, {"truth_m", s.true_way}});
  if (shows_bodies && turns && turns_agree && !is_scaled && difference(s, scope) >= kDifference) {
    if (const auto p = lever_arm(motions, s))
      return make_finding(
          "truth-body",
          fmt::format("the displacements of {} differ by {:.2g} m over 1 s (median) as those of "
                      "two points of one body {:.2f} m apart: the truth is not the pose of the "
                      "camera",
                      between, s.way_error, p->norm()),
          fmt::format("name its frame by --truth-frame, with the translation ({:.3f}, {:.3f}, "
                      "{:.3f}) of T_body_camera",
                      -p->x(), -p->y(), -p->z()));
  }
  const bool turns_alike = turns && turns_agree;  // of one recording
  if (!turns_alike && way_error >= kUnrelated * way)
    return make_finding(
        "truth-unrelated",
        fmt::format("the displacements of {} have hardly anything in common: {:.3g} and {:.3g} m "
                    "over 1 s (median), and {:.3g} m apart",
                    between, s.way, s.true_way, way_error),
        advice);
  return std::nullopt;
}

/// Returns the finding that the times of a file were rounded; none if they were not.
std::optional<Finding> finding_of_times(const Trajectory& trajectory, const std::string& file) {
  constexpr double kMost = 0.1;       // share of the poses
  constexpr double kSamePose = 1e-9;  // [m], [rad]
  std::size_t repeated = 0;           // poses that differ
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    const StampedPose &before = trajectory[i - 1], &pose = trajectory[i];
    const Pose T_before_pose = before.T_world_camera.inverse() * pose.T_world_camera;
    repeated += pose.timestamp == before.timestamp && T_before_pose.log().norm() > kSamePose;
  }
  if (static_cast<double>(repeated) <= kMost * static_cast<double>(trajectory.size()))
    return std::nullopt;
  return make_finding(
      "truth-times",
      fmt::format("{} of {} poses of {} have the time of another one and are left out, as if the "
                  "times had been rounded",
                  repeated, trajectory.size(), file),
      "write them with 6 decimals");
}

std::optional<Finding> finding_of_readings(const Trajectory& truth, const Trajectory& estimate,
                                           const TrajectoryNames& names, bool scale_is_known) {
  const std::vector<Motion> as_read = motions(truth, estimate);
  if (as_read.empty()) return std::nullopt;
  const Sizes size = sizes(as_read);
  const Scope scope{has_only_positions(truth, estimate), scale_is_known};
  if (difference(size, scope) >= kDifference) {
    if (const auto best = best_reading(truth, estimate, names, scope, size))
      return make_finding(
          "truth-reading",
          fmt::format("the motions of {} and {} over 1 s differ by {} (median), and by {} {}",
                      names.estimate, names.truth, difference_text(size, scope), best->differs_by,
                      best->condition),
          best->fix);
  }
  return finding_of_motions(as_read, size, names, scope);
}

}  // namespace

std::vector<Finding> truth_findings(const Trajectory& truth, const Trajectory& estimate,
                                    const TrajectoryNames& names, bool scale_is_known) {
  std::vector<Finding> findings;
  for (const auto& found :
       {finding_of_times(truth, names.truth), finding_of_times(estimate, names.estimate),
        finding_of_readings(truth, estimate, names, scale_is_known)}) {
    if (found) findings.push_back(*found);
  }
  return findings;
}

}  // namespace stillmap
