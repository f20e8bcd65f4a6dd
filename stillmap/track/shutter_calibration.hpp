// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/frame.hpp"
#include "stillmap/track/motion_compensation.hpp"
#include "stillmap/track/pose_estimate.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Estimates the timing of a camera's shutters from tracked frames.
///
/// Points at rest that two frames observe are exposed at other times than the middle of the images.
/// Residuals between the frames that are proportional to the velocity of the camera and to the row
/// show the readout time; those of the depth that are proportional to its change along the image
/// motion show the delay of the depth image. Both are estimated together with the relative pose of
/// the frames (8 unknowns), and the estimates of all pairs are averaged by their information. The
/// map is not used, because its landmarks bear the errors of a wrong timing. The timing is used
/// once it is certain.
class ShutterCalibration {
 public:
  /// @param start timing in use until another one is certain
  explicit ShutterCalibration(const ShutterTiming& start = {}) : timing_(start) {}

  /// Adds a tracked frame, whose features were compensated with timing().
  /// @param previous per keypoint of the frame: its keypoint in the previous frame, or -1. These
  ///        matches must not have been selected by their residuals.
  void add(const TrackingModel& model, const FramePtr& frame, const Pose& T_world_camera,
           const std::vector<std::int32_t>& previous);
  /// Forgets the previous frames, after which the camera was lost.
  void interrupt() {
    views_.clear();
    tracks_.clear();
    newest_.clear();
  }

  /// Correction of the timing in use that the frames since its last change show: readout time and
  /// depth delay [s].
  struct Correction {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Vector2d sigma = Eigen::Vector2d::Zero();  ///< Standard deviations.
  };
  /// Returns nothing before enough frames were added.
  std::optional<Correction> correction() const;

  /// Returns the timing in use.
  const ShutterTiming& timing() const { return timing_; }

 private:
  /// A tracked point in a frame: measurement (u, v, d), point in the camera frame [m], and their
  /// derivatives by readout time and depth delay.
  struct TimedPoint {
    std::uint32_t track = 0;
    float weight = 0;
    Measurement measurement;
    Eigen::Vector3d p_camera = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 3, 2> d_measurement = Eigen::Matrix<double, 3, 2>::Zero();
    Eigen::Matrix<double, 3, 2> d_point = Eigen::Matrix<double, 3, 2>::Zero();
  };
  /// A tracked frame.
  struct Tracked {
    FramePtr frame;
    Pose T_world_camera;
    std::vector<std::uint32_t> tracks;  ///< per keypoint
  };
  struct View {
    Pose T_world_camera;
    std::vector<TimedPoint> points;  ///< by ascending track
  };
  /// Normal equations of the relative pose and the timing (8 unknowns) of two frames.
  struct PairNormal {
    Eigen::Matrix<double, 8, 8> H = Eigen::Matrix<double, 8, 8>::Zero();
    Eigen::Matrix<double, 8, 1> g = Eigen::Matrix<double, 8, 1>::Zero();
    int common = 0;                      ///< Number of points.
    double squares = 0, components = 0;  ///< Weighted residuals [sigma^2] and their number.
    void add(const Camera& camera, const TimedPoint& a, const TimedPoint& b, const Pose& T_to_from,
             const Eigen::Vector2d& correction);
  };
  /// Information matrix and vector of a correction of the timing.
  struct Evidence {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d vector = Eigen::Vector2d::Zero();
  };

  TimedPoint timed_point(const TrackingModel& model, const MotionCompensation& compensation,
                         const Keypoint& recorded) const;
  static PairNormal normal_of(const Camera& camera, const View& from, const View& to,
                              const Pose& T_to_from, const Eigen::Vector2d& correction);
  static std::optional<Evidence> evidence(const Camera& camera, const View& from, const View& to);
  View view_of_middle(const TrackingModel& model) const;
  void update(const Camera& camera);

  ShutterTiming timing_;
  std::deque<View> views_;
  std::vector<std::uint32_t> tracks_;  // per keypoint of the previous frame
  std::deque<Tracked> newest_;         // the last three frames
  std::uint32_t next_track_ = 0;
  // Of the corrections of the timing since it changed.
  Eigen::Matrix2d information_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted_sum_ = Eigen::Vector2d::Zero();
  double squares_ = 0;
  int frames_ = 0;
};

}  // namespace stillmap
