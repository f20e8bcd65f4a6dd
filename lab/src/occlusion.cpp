// SPDX-License-Identifier: Apache-2.0
/// Occlusion: a board that moves covers a share of the view of the simulated office for some
/// seconds, while the camera is held (xyz) and while it is carried on (loop). Printed per case: the
/// covered frames that have a pose, by the images or by IMU and wheels; the frames between the end
/// of the occlusion and the next pose by images; the maps begun after the first one, dropped and
/// left at the end; the frames with a pose and the ATE of all of them; of the poses handed out
/// during the run the largest error, and of those without images the largest error relative to the
/// last pose by images, and the mean of its squares over the covariance (6 is expected).
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/simulate/board.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <functional>

#include "commands.hpp"
#include <Eigen/Cholesky>
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

constexpr double kFps = 30;

struct OcclusionArguments {
  std::vector<std::string> cameras = {"xyz", "loop"};
  std::vector<double> shares = {0.0, 0.6, 0.8, 1.0};  ///< of the view's width that is covered
  std::vector<std::size_t> seconds = {1, 2, 3};
  std::size_t frames = 300;  ///< in all
  std::size_t from = 120;    ///< the first frame that is covered
  bool plain = false;        ///< the board has no print
  std::string imu;           ///< name of the IMU; empty: none
  bool wheels = false;       ///< whether the camera is on wheels
  int seed = 1;
};

/// Range of the frames that the board covers, [from, to).
struct Covered {
  std::size_t from = 0, to = 0;
};

SimulatedSequence sequence_of(const std::string& camera, const OcclusionArguments& arguments) {
  SimulationOptions options;
  options.imu = arguments.imu;
  options.wheels = arguments.wheels;
  options.seed = arguments.seed;
  options.people = 0;
  options.camera = camera;
  options.frames = static_cast<int>(arguments.frames);
  options.width = 320;
  options.height = 240;
  return SimulatedSequence(options);
}

std::vector<RgbdFramePtr> frames_of(const SimulatedSequence& sequence) {
  std::vector<RgbdFramePtr> frames;
  for (std::size_t i = 0; i < sequence.frames(); ++i) frames.push_back(sequence.frame(i));
  return frames;
}

/// A pose handed out during a run.
struct Returned {
  UncertainPose pose;
  bool predicted = false;  ///< by IMU or wheels
};

struct Run {
  SlamResult result;
  std::vector<Returned> returned;
};

Run run(const std::vector<RgbdFramePtr>& frames, const Camera& camera, const Board& board,
        const Covered& covered) {
  std::vector<Returned> returned;
  SlamParameters options;
  options.orb.keypoints = 600;
  options.dense_cloud = false;
  SlamSystem slam(camera, options);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool is_covered = i >= covered.from && i < covered.to;
    const double since = static_cast<double>(i - covered.from) / kFps;
    const auto pose = slam.push(is_covered ? behind(board, *frames[i], camera, since) : frames[i]);
    const TrackedFrame& tracked = *slam.newest();
    if (pose)
      returned.push_back({{frames[i]->timestamp, *pose, tracked.covariance}, !tracked.has_pose()});
  }
  return {slam.finish(), returned};
}

/// Errors of the poses handed out during a run.
struct ReturnedErrors {
  double largest = 0;        ///< Relative to the first pose [m].
  double largest_drift = 0;  ///< Without images, relative to the last pose by images [m].
  double normalized = 0;     ///< Mean squared error of the latter [sigma^2].
};

/// Returns the error of the motion from one pose to another.
Vector6d error_between(const SimulatedSequence& truth, const UncertainPose& a,
                       const UncertainPose& b) {
  const Pose estimated = a.T_world_camera.inverse() * b.T_world_camera;
  return (estimated.inverse() * truth.motion(a.timestamp).inverse() * truth.motion(b.timestamp))
      .log();
}

ReturnedErrors errors_of(const std::vector<Returned>& returned, const SimulatedSequence& truth) {
  ReturnedErrors errors;
  int predicted = 0;
  UncertainPose last = returned.front().pose;
  for (const Returned& r : returned) {
    const Vector6d error = error_between(truth, returned.front().pose, r.pose);
    errors.largest = std::max(errors.largest, error.head<3>().norm());
    if (!r.predicted) {
      last = r.pose;
      continue;
    }
    const Vector6d drift = error_between(truth, last, r.pose);
    errors.largest_drift = std::max(errors.largest_drift, drift.head<3>().norm());
    errors.normalized += drift.dot(r.pose.covariance.llt().solve(drift));
    ++predicted;
  }
  if (predicted > 0) errors.normalized /= predicted;
  return errors;
}

void print(const Run& run, const SimulatedSequence& sequence, const Covered& covered) {
  const SlamResult& result = run.result;
  const auto begin = result.frames.begin();
  const auto gone = begin + static_cast<std::ptrdiff_t>(covered.to);
  const auto posed = std::count_if(begin + static_cast<std::ptrdiff_t>(covered.from), gone,
                                   std::mem_fn(&FrameRecord::has_pose));
  const auto by_images = [](const FrameRecord& f) { return f.has_pose() && !f.predicted(); };
  const auto again = std::find_if(gone, result.frames.end(), by_images) - gone;
  const auto begun = std::count_if(begin + 1, result.frames.end(), [](const FrameRecord& f) {
    return f.state == TrackState::kStarted;
  });
  const auto dropped = std::count_if(result.events.begin(), result.events.end(), [](const auto& e) {
    return e.kind == MapEvent::Kind::kDropped;
  });
  const ReturnedErrors errors = errors_of(run.returned, sequence);
  fmt::print("{:3} of {:3}   {:2}   {} {} {}   {} of {}   {:.4f}   {:.4f}   {:.4f}   {:.1f}\n",
             posed, covered.to - covered.from, again, begun, dropped, result.maps, result.tracked(),
             result.frames.size(),
             absolute_trajectory_error(sequence.trajectory(), result.trajectory).translation.rmse,
             errors.largest, errors.largest_drift, errors.normalized);
}

void measure(const OcclusionArguments& arguments) {
  for (const std::string& camera : arguments.cameras) {
    const SimulatedSequence sequence = sequence_of(camera, arguments);
    const auto frames = frames_of(sequence);
    fmt::print(
        "{}\n  share seconds  posed  after  maps begun, dropped, left  tracked  ATE [m]  returned: "
        "largest error [m], of dead reckoning [m], normalized\n",
        camera);
    for (const double share : arguments.shares) {
      for (const std::size_t seconds : arguments.seconds) {
        if (share == 0 && seconds != arguments.seconds.front()) break;
        const Covered covered{arguments.from,
                              arguments.from + seconds * static_cast<std::size_t>(kFps)};
        if (covered.to >= frames.size())
          throw Error("the board stays until the end", "--seconds", "raise --frames");
        fmt::print("  {:.1f} {}   ", share, seconds);
        const Board board{.share = share, .printed = !arguments.plain};
        print(run(frames, sequence.camera(), board, covered), sequence, covered);
      }
    }
  }
}

}  // namespace

void add_occlusion_command(CLI::App& app) {
  auto arguments = std::make_shared<OcclusionArguments>();
  CLI::App* command = app.add_subcommand(
      "occlusion", "measure tracking and mapping while a large moving board covers the view");
  command->add_option("--camera", arguments->cameras, "camera motions of the simulated office")
      ->capture_default_str();
  command->add_option("--share", arguments->shares, "shares of the view that are covered [0..1]")
      ->capture_default_str();
  command->add_option("--seconds", arguments->seconds, "durations of the occlusion [s]")
      ->capture_default_str();
  command->add_option("--frames", arguments->frames, "frames of the sequence")
      ->capture_default_str();
  command->add_option("--from", arguments->from, "first frame that is covered")
      ->capture_default_str();
  command->add_option("--imu", arguments->imu, "IMU on the camera");
  command->add_flag("--wheels", arguments->wheels, "odometry of wheels that carry the camera");
  command->add_option("--seed", arguments->seed, "seed of the scene and the noise")
      ->capture_default_str();
  command->add_flag("--plain", arguments->plain, "the board has no print");
  command->callback([arguments] { measure(*arguments); });
}

}  // namespace stillmap::lab
