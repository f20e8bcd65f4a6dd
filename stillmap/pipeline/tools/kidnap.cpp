// SPDX-License-Identifier: Apache-2.0
/// How a camera that was carried away finds back:
///
///     ninja -C build/release stillmap_kidnap
///     build/release/rooms/pipeline/stillmap_kidnap [--people N]
///
/// Two rooms of the simulated flat are mapped along a way through them. Then, time after time, the
/// camera is covered for three seconds and uncovered elsewhere, for two: at 20 places of those
/// rooms, a hand's breadth beside the way and with another tremor, and at 5 in the rooms that it
/// has never seen. Printed for each: after how many frames there was a pose, how it came about, and
/// how far off the pose is; at the end how many were recognised, and how many wrongly.
#include "stillmap/base/error.hpp"
#include "stillmap/pipeline/slam.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cstring>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kFps = 15;
constexpr std::size_t kMapped = 1050;              // frames: 28 m of the way, two rooms
constexpr std::size_t kDark = 45, kUncovered = 30;  // frames
constexpr double kRight = 0.1;                      // metres: a pose farther off is wrong

/// A place, and what became of it.
struct Visit {
  std::size_t from = 0;  ///< frame of the second way
  bool known = true;
  std::size_t first = 0;  ///< frame as pushed, of the first one with light
};

SimulationOptions simulation(int people) {
  SimulationOptions options;
  options.scene = "flat";
  options.people = people;
  options.camera = "loop";
  options.frames = 2400;
  options.fps = kFps;
  options.width = 320;
  options.height = 240;
  return options;
}

/// The same rooms, but the way shifted, and another hand.
SimulatedSequence beside(const SimulatedSequence& way) {
  auto scene = std::make_shared<Scene>(way.scene());
  for (Eigen::Vector2f& corner : scene->round) corner += Eigen::Vector2f(0.1F, 0.12F);
  SimulationOptions options = way.options();
  options.seed = 77;
  options.frames = 3000;
  return {options, way.camera(), scene};
}

std::vector<Visit> visits() {
  std::vector<Visit> made;
  std::size_t known = 0, unknown = 0;
  for (int i = 0; i < 25; ++i) {
    const bool is_known = i % 5 != 4;
    // Spread over the way, in no order: steps that share no divisor with the range.
    const std::size_t at = is_known ? 20 + (known++ * 377) % 950 : 1300 + (unknown++ * 211) % 800;
    made.push_back({at, is_known, 0});
  }
  return made;
}

RgbdFramePtr stamped(const RgbdFrame& frame, std::size_t index, bool dark) {
  auto copy = std::make_shared<RgbdFrame>(frame);
  copy->index = index;
  copy->timestamp = static_cast<double>(index) / kFps;
  if (dark) {
    copy->grey = cv::Mat(frame.grey.size(), frame.grey.type(), cv::Scalar::all(0));
    copy->color = cv::Mat(frame.color.size(), frame.color.type(), cv::Scalar::all(0));
  }
  return copy;
}

struct Judged {
  std::optional<std::size_t> frames;  ///< with light until there was a pose
  bool relocalised = false;
  double metres = 0;  ///< largest error of a pose, where it is known
};

Judged judge(const Visit& visit, const SlamResult& result, const SimulatedSequence& way,
             const SimulatedSequence& other) {
  Judged judged;
  const Pose T_world_truth =
      result.trajectory.front().T_world_camera * way.T_world_camera(0).inverse();
  for (std::size_t i = 0; i < kUncovered; ++i) {
    const std::size_t frame = visit.first + i;
    const FrameRecord& record = result.frames[frame];
    judged.relocalised |= record.relocalised;
    const double stamp = static_cast<double>(frame) / kFps;
    const auto pose = std::find_if(
        result.trajectory.begin(), result.trajectory.end(),
        [&](const StampedPose& p) { return std::abs(p.timestamp - stamp) < 1e-6; });
    if (pose == result.trajectory.end()) continue;
    if (!judged.frames) judged.frames = i;
    const Pose truth = T_world_truth * other.T_world_camera(visit.from + i);
    judged.metres = std::max(
        judged.metres, (truth.translation() - pose->T_world_camera.translation()).norm());
  }
  return judged;
}

void run(int people) {
  const SimulatedSequence way(simulation(people));
  const SimulatedSequence other = beside(way);
  SlamOptions options;
  options.orb.keypoints = 600;
  options.dense_cloud = false;
  Slam slam(way.camera(), options);
  std::size_t n = 0;
  for (; n < kMapped; ++n) slam.push(stamped(*way.frame(n), n, false));
  std::vector<Visit> places = visits();
  for (Visit& visit : places) {
    const RgbdFramePtr dark = other.frame(visit.from);
    for (std::size_t i = 0; i < kDark; ++i, ++n) slam.push(stamped(*dark, n, true));
    visit.first = n;
    for (std::size_t i = 0; i < kUncovered; ++i, ++n)
      slam.push(stamped(*other.frame(visit.from + i), n, false));
  }
  const SlamResult result = slam.finish();

  int recognised = 0, wrong = 0, known = 0;
  std::vector<std::size_t> waited;
  for (const Visit& visit : places) {
    const Judged j = judge(visit, result, way, other);
    const bool by_place = visit.known && j.frames && j.metres < kRight;
    known += visit.known;
    recognised += by_place;
    wrong += j.relocalised && (!visit.known || j.metres > kRight);
    if (by_place) waited.push_back(*j.frames);
    fmt::print("{:7} place, frame {:4}: {} {}, {}\n", visit.known ? "known" : "unknown",
               visit.from, j.frames ? fmt::format("pose after {} frames", *j.frames) : "no pose",
               j.relocalised ? "(recognised)" : "",
               visit.known ? fmt::format("{:.3f} m off at most", j.metres) : "nothing to compare");
  }
  std::sort(waited.begin(), waited.end());
  fmt::print("{} of {} known places recognised, after {} frames in the median, {} at most\n",
             recognised, known, waited.empty() ? 0 : waited[waited.size() / 2],
             waited.empty() ? 0 : waited.back());
  fmt::print("{} wrong; {} maps at the end, {} merges, loops or maps dropped\n", wrong, result.maps,
             result.events.size());
  for (const StageTiming& stage : result.timing.stages()) {
    if (stage.name == "relocalisation")
      fmt::print("relocalisation: {:.1f} ms in the median, {:.1f} at most\n", stage.median,
                 stage.max);
  }
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  const bool people = argc == 3 && std::strcmp(argv[1], "--people") == 0;
  try {
    stillmap::run(people ? std::stoi(argv[2]) : 0);
  } catch (const stillmap::Error& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
