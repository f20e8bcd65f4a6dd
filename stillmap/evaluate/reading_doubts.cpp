// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/reading_doubts.hpp"

#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/evaluate/statistics.hpp"
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
/// Ratio of two errors, or of two displacements, from which one of them is that of a wrong reading.
/// A wrong order or frame gives errors of the size of the motion itself.
constexpr double kRatio = 5;
/// Motions with an error of this share of their size have hardly anything in common: unrelated
/// motions of one size have at least 1.
constexpr double kUnrelated = 0.8;
/// Median motion over one second below which nothing is told.
constexpr double kLeastTurn = 2, kLeastWay = 0.05;      // [degrees], [m]
constexpr std::size_t kMostMotions = 500;               // spread evenly over the estimate
constexpr double kLargestDelay = 3, kDelayStep = 0.05;  // [s]

/// A motion of the camera over one second, in the frame of its beginning.
struct Motion {
  Pose truth, estimate;
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
    result.push_back({true_begin->inverse() * *true_end, T_begin.inverse() * end->T_world_camera});
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
      readings.push_back({*of_truth, *of_estimate, fmt::format(fmt::runtime(condition), file),
                          fmt::format(fmt::runtime(fix), file == both ? "FILE" : file)});
    }
  };
  add(with_qw_first, "if the quaternions of {} are read as qw qx qy qz",
      "write the order of TUM, qx qy qz qw: awk '!/^#/ {{print $1,$2,$3,$4,$6,$7,$8,$5}}' {}");
  add(inverted, "if the poses of {} are inverted",
      "write T_world_camera, the pose of the camera in the world, to {}");
  if (!names.truth_frame.empty())
    readings.push_back({in_file, estimate, "without --truth-frame " + names.truth_frame,
                        "leave it out: the truth is already the pose of the camera"});
  return readings;
}

/// Rotation error of the best other reading [degrees], and its text.
struct BestReading {
  double turn_error = 0, way_error = 0;
  std::string condition, fix;
};

/// Returns whether a reading is better: several may have the same rotations, as those of a camera
/// that turns about one axis.
bool is_better(const BestReading& a, const BestReading& b) {
  constexpr double kDegreesPerMeter = 100;  // errors of tracking are some 1 cm and 1 degree
  const auto error = [](const BestReading& r) {
    return r.turn_error + kDegreesPerMeter * r.way_error;
  };
  return error(a) < error(b);
}

/// Returns the best reading of those whose rotation error is below the bound [degrees].
std::optional<BestReading> best_reading(const Trajectory& truth, const Trajectory& estimate,
                                        const TrajectoryNames& names, double bound) {
  std::optional<BestReading> best;
  const auto consider = [&](const std::vector<Motion>& motions, const std::string& condition,
                            const std::string& fix) {
    if (motions.empty()) return;
    const BestReading reading{median(motions, turn_error), median(motions, way_error), condition,
                              fix};
    if (reading.turn_error <= bound && (!best || is_better(reading, *best))) best = reading;
  };
  for (const Reading& reading : other_readings(truth, estimate, names))
    consider(motions(reading.truth, reading.estimate), reading.condition, reading.fix);
  for (int step = 1; step * kDelayStep <= kLargestDelay; ++step) {
    for (const double delay : {step * kDelayStep, -step * kDelayStep}) {
      consider(motions(truth, estimate, delay),
               fmt::format("if the times of {} are made {:.2f} s {}", names.truth, std::abs(delay),
                           delay > 0 ? "earlier" : "later"),
               "give both trajectories the clock of the images");
    }
  }
  return best;
}

/// Returns whether the positions change and the rotations do not, as in a file of positions.
bool has_only_positions(const Trajectory& trajectory) {
  const Pose T_first_world = trajectory.front().T_world_camera.inverse();
  bool turns = false, moves = false;
  for (const StampedPose& pose : trajectory) {
    const Pose T = T_first_world * pose.T_world_camera;
    turns = turns || T.angle() > 1e-6;
    moves = moves || T.translation().norm() > 1e-6;
  }
  return moves && !turns;
}

/// Returns what motions that no other reading explains have in common.
std::string doubt_of_motions(const Sizes& s, const TrajectoryNames& names, bool only_positions,
                             bool scale_is_known) {
  const double turn = std::max(s.true_turn, s.turn), way = std::max(s.true_way, s.way);
  const bool turns = turn >= kLeastTurn && !only_positions, moves = way >= kLeastWay;
  const double difference = only_positions ? s.length_error : s.way_error;
  const std::string between = fmt::format("{} and {}", names.estimate, names.truth);
  if (turns && s.turn_error >= kAgreement && s.angle_error <= s.turn_error / kRatio)
    return fmt::format(
        "{} turn by the same angles over 1 s (median {:.3g} degrees, difference {:.2g}), but about "
        "other axes ({:.3g} degrees apart): one of them is the pose of another body than the "
        "camera; name its frame by --truth-frame",
        between, s.true_turn, s.angle_error, s.turn_error);
  const std::string advice =
      "either the truth is that of another recording, or tracking failed; give the truth of this "
      "recording or look at the report";
  if (turns && s.turn_error >= kUnrelated * turn)
    return fmt::format(
        "the rotations of {} have hardly anything in common: {:.3g} and {:.3g} degrees over 1 s "
        "(median), and {:.3g} apart; {}",
        between, s.turn, s.true_turn, s.turn_error, advice);
  if (!moves || !scale_is_known) return "";
  const bool turns_agree = only_positions || s.turn_error <= std::max(kAgreement, turn / kRatio);
  if (turns_agree && way > kRatio * std::min(s.true_way, s.way) && s.true_way > 0 && s.way > 0)
    return fmt::format(
        "the camera moves by {:.3g} m over 1 s in {} and by {:.3g} m in {} (median): write both "
        "in meters",
        s.way, names.estimate, s.true_way, names.truth);
  if (difference >= kUnrelated * way)
    return fmt::format(
        "the displacements of {} have hardly anything in common: {:.3g} and {:.3g} m over 1 s "
        "(median), and {:.3g} m apart; {}",
        between, s.way, s.true_way, difference, advice);
  return "";
}

}  // namespace

std::vector<std::string> reading_doubts(const Trajectory& truth, const Trajectory& estimate,
                                        const TrajectoryNames& names, bool scale_is_known) {
  const std::vector<Motion> as_read = motions(truth, estimate);
  if (as_read.empty()) return {};
  const Sizes size = sizes(as_read);
  if (size.turn_error >= kAgreement) {
    if (const auto best = best_reading(truth, estimate, names, size.turn_error / kRatio))
      return {fmt::format(
          "the rotations of {} and {} differ by {:.3g} degrees over 1 s (median), and by {:.2g} "
          "{}; {}",
          names.estimate, names.truth, size.turn_error, best->turn_error, best->condition,
          best->fix)};
  }
  const std::string doubt =
      doubt_of_motions(size, names, has_only_positions(truth), scale_is_known);
  return doubt.empty() ? std::vector<std::string>() : std::vector<std::string>{doubt};
}

}  // namespace stillmap
