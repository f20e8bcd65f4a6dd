// SPDX-License-Identifier: Apache-2.0
/// What becomes of the map when something large is carried past close before the camera:
///
///     ninja -C build/release stillmap_cover
///     build/release/rooms/pipeline/stillmap_cover [--plain]
///
/// A printed board that moves (--plain: one without print) covers 60, 80 and 100 % of the view of
/// the simulated office for one, two and three seconds, while the camera is held (xyz) and while it
/// is carried on (loop). Printed: of the covered frames those with a pose; how many frames after
/// the board was gone the next pose came; maps begun after the first, left out and left at the end;
/// frames in the trajectory, and the ATE of all of them.
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/slam.hpp"
#include "stillmap/simulate/board.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cstring>
#include <functional>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::size_t kFrames = 300, kFrom = 120;  // in all; the first that is covered
constexpr double kFps = 30;

SimulatedSequence sequence(const std::string& camera) {
  SimulationOptions options;
  options.people = 0;
  options.camera = camera;
  options.frames = kFrames;
  options.width = 320;
  options.height = 240;
  return SimulatedSequence(options);
}

std::vector<RgbdFramePtr> frames_of(const SimulatedSequence& sequence) {
  std::vector<RgbdFramePtr> frames;
  for (std::size_t i = 0; i < sequence.frames(); ++i) frames.push_back(sequence.frame(i));
  return frames;
}

SlamResult run(const std::vector<RgbdFramePtr>& frames, const Camera& camera, const Board& board,
               std::size_t to) {
  SlamOptions options;
  options.orb.keypoints = 600;
  options.dense_cloud = false;
  Slam slam(camera, options);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool covered = i >= kFrom && i < to;
    const double since = static_cast<double>(i - kFrom) / kFps;
    slam.push(covered ? behind(board, *frames[i], camera, since) : frames[i]);
  }
  return slam.finish();
}

void print(const SlamResult& result, const Trajectory& truth, std::size_t to) {
  const auto begin = result.frames.begin();
  const auto gone = begin + static_cast<std::ptrdiff_t>(to);
  const auto covered = std::count_if(begin + kFrom, gone, std::mem_fn(&FrameRecord::has_pose));
  const auto again =
      std::find_if(gone, result.frames.end(), std::mem_fn(&FrameRecord::has_pose)) - gone;
  const auto begun = std::count_if(begin + 1, result.frames.end(), [](const FrameRecord& f) {
    return f.state == TrackState::kStarted;
  });
  const auto dropped = std::count_if(result.events.begin(), result.events.end(), [](const auto& e) {
    return e.kind == MapEvent::Kind::kDropped;
  });
  fmt::print("{:3} of {:2}   {:2}   {} {} {}   {} of {}   {:.4f}\n", covered, to - kFrom, again,
             begun, dropped, result.maps, result.tracked(), kFrames,
             absolute_trajectory_error(truth, result.trajectory).translation.rmse);
}

void measure(bool printed) {
  for (const std::string camera : {"xyz", "loop"}) {
    const SimulatedSequence way = sequence(camera);
    const auto frames = frames_of(way);
    fmt::print("{}\n  share seconds  posed  after  maps begun, dropped, left  tracked  ATE [m]\n",
               camera);
    for (const double share : {0.0, 0.6, 0.8, 1.0}) {
      for (const std::size_t seconds : {1, 2, 3}) {
        if (share == 0 && seconds > 1) break;
        const std::size_t to = kFrom + seconds * static_cast<std::size_t>(kFps);
        fmt::print("  {:.1f} {}   ", share, seconds);
        print(run(frames, way.camera(), {.share = share, .printed = printed}, to), way.trajectory(),
              to);
      }
    }
  }
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  try {
    stillmap::measure(argc != 2 || std::strcmp(argv[1], "--plain") != 0);
  } catch (const stillmap::Error& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
