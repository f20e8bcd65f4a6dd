// SPDX-License-Identifier: Apache-2.0
/// How a camera that was carried away finds back, and its maps to each other:
///
///     ninja -C build/release stillmap_kidnap
///     build/release/rooms/pipeline/stillmap_kidnap [--people N] [--scattered]
///
/// Two rooms of the simulated flat are mapped along a way through them. Then, time after time, the
/// camera is covered for three seconds and uncovered elsewhere, for two: at 20 places of those
/// rooms, a hand's breadth beside the way and with another tremor, and at 5 in the rooms that it
/// has never seen, where it begins maps. At last it is covered once more and goes on along the way
/// through the other rooms, past those 5 places, and home. While it is carried away, N people walk
/// about on the same way. Printed for each place: after how many frames there was a pose, how it
/// came about, and how far off the pose is from where the frames mapped nearby say that it is (the
/// map as a whole may have drifted); at the end how many were recognized, how many wrongly, and
/// which maps were joined.
///
/// --scattered: the whole way in pieces of two seconds, in no order, and darkness between: nearly
/// every piece begins a map, and where pieces overlap they are to be joined. Printed: for every
/// join and loop how far off it is, and how many were wrong.
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/slam.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kFps = 15;
constexpr std::size_t kMapped = 1050;                   // frames: 28 m of the way, two rooms
constexpr std::size_t kDark = 45, kUncovered = 30;      // frames
constexpr std::size_t kHomeFrom = 950, kHomeTo = 2400;  // frames of the way home
constexpr std::size_t kPiece = 30, kShortDark = 3;      // frames
constexpr double kRight = 0.1;                          // meters: a pose farther off is wrong

/// A place, and what became of it.
struct Visit {
  std::size_t from = 0;  ///< frame of the second way
  bool known = true;
  std::size_t first = 0;  ///< frame as pushed, of the first one with light
};

SimulationOptions simulation() {
  SimulationOptions options;
  options.scene = "flat";
  options.people = 0;
  options.camera = "loop";
  options.frames = 2400;
  options.fps = kFps;
  options.width = 320;
  options.height = 240;
  return options;
}

/// The same rooms, but the way shifted, and another hand.
SimulatedSequence beside(const SimulatedSequence& way, int people) {
  auto scene = std::make_shared<Scene>(make_scene({.scene = "flat", .people = people}));
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
    const std::size_t at = is_known ? 20 + (known++ * 377) % 950 : 1280 + unknown++ * 190;
    made.push_back({at, is_known, 0});
  }
  return made;
}

RgbdFramePtr stamped(const RgbdFrame& frame, std::size_t index, bool dark) {
  auto copy = std::make_shared<RgbdFrame>(frame);
  copy->index = index;
  copy->timestamp = static_cast<double>(index) / kFps;
  if (dark) {
    copy->gray = cv::Mat(frame.gray.size(), frame.gray.type(), cv::Scalar::all(0));
    copy->color = cv::Mat(frame.color.size(), frame.color.type(), cv::Scalar::all(0));
  }
  return copy;
}

struct Judged {
  std::optional<std::size_t> frames;  ///< with light until there was a pose
  bool relocalized = false;
  double meters = 0;  ///< largest error of a pose, from where it was recognized
};

/// Estimates and the truth, by frame as pushed.
struct Judge {
  std::map<std::size_t, Pose> estimate;
  std::vector<std::optional<Pose>> truth;  ///< none while it was covered

  /// How far a frame is from where it should be beside those mapped before a visit, in whichever of
  /// the maps that were taken nearby agrees best [m].
  double error(std::size_t frame, std::size_t visited_from) const {
    constexpr double kNearby = 3, kAlike = 1;  // meters, radians
    double least = 1e9;
    for (const auto& [other, pose] : estimate) {
      if (other >= visited_from) break;
      const Pose expected = truth[other]->inverse() * *truth[frame];
      if (expected.translation().norm() > kNearby || expected.angle() > kAlike) continue;
      const Pose found = pose.inverse() * estimate.at(frame);
      least = std::min(least, (expected.translation() - found.translation()).norm());
    }
    return least;
  }
};

Judged judge(const Visit& visit, const SlamResult& result, const Judge& by) {
  Judged judged;
  for (std::size_t i = 0; i < kUncovered; ++i) {
    const std::size_t frame = visit.first + i;
    judged.relocalized |= result.frames[frame].relocalized;
    if (!by.estimate.contains(frame)) continue;
    if (!judged.frames) judged.frames = i;
    if (judged.relocalized) judged.meters = std::max(judged.meters, by.error(frame, visit.first));
  }
  return judged;
}

/// The camera's frames in the order in which it saw them.
class Tour {
 public:
  Tour(Slam& slam, Judge& judge) : slam_(slam), judge_(judge) {}

  void see(const SimulatedSequence& way, std::size_t from, std::size_t count) {
    for (std::size_t i = from; i < from + count; ++i) {
      slam_.push(stamped(*way.frame(i), seen(), false));
      judge_.truth.emplace_back(way.T_world_camera(i));
    }
  }
  void be_covered(const SimulatedSequence& way, std::size_t count = kDark) {
    const RgbdFramePtr any = way.frame(0);
    for (std::size_t i = 0; i < count; ++i) {
      slam_.push(stamped(*any, seen(), true));
      judge_.truth.emplace_back();
    }
  }
  std::size_t seen() const { return judge_.truth.size(); }

 private:
  Slam& slam_;
  Judge& judge_;
};

void print_places(const std::vector<Visit>& places, const SlamResult& result, const Judge& by) {
  int recognized = 0, wrong = 0, known = 0;
  std::vector<std::size_t> waited;
  for (const Visit& visit : places) {
    const Judged j = judge(visit, result, by);
    const bool by_place = visit.known && j.relocalized && j.meters < kRight;
    known += visit.known;
    recognized += by_place;
    wrong += j.relocalized && j.meters > kRight;
    if (by_place) waited.push_back(*j.frames);
    fmt::print("{:7} place, frame {:4}: {}{}{}\n", visit.known ? "known" : "unknown", visit.from,
               j.frames ? fmt::format("pose after {} frames", *j.frames) : "no pose",
               j.relocalized ? " (recognized)" : "",
               j.relocalized ? fmt::format(", {:.3f} m off at most", j.meters) : "");
  }
  std::sort(waited.begin(), waited.end());
  fmt::print("{} of {} known places recognized, after {} frames in the median, {} at most\n",
             recognized, known, waited.empty() ? 0 : waited[waited.size() / 2],
             waited.empty() ? 0 : waited.back());
  fmt::print("{} wrong\n", wrong);
}

const char* name_of(MapEvent::Kind kind) {
  if (kind == MapEvent::Kind::kLoop) return "loop";
  return kind == MapEvent::Kind::kMerge ? "maps joined" : "map dropped";
}

/// How far off the place of a frame beside that of another is, which it was held to show [m]; none
/// where either has no pose.
std::optional<double> off(const Judge& by, std::size_t frame, std::size_t seen_in) {
  if (!by.estimate.contains(frame) || !by.estimate.contains(seen_in)) return std::nullopt;
  const Pose truth = by.truth[seen_in]->inverse() * *by.truth[frame];
  const Pose found = by.estimate.at(seen_in).inverse() * by.estimate.at(frame);
  return (truth.translation() - found.translation()).norm();
}

void print_events(const SlamResult& result, const Judge& by) {
  int joined = 0, wrong = 0;
  for (const MapEvent& e : result.events) {
    if (e.kind == MapEvent::Kind::kDropped) continue;
    const auto meters = off(by, e.frame_index, e.seen_in);
    fmt::print("{}: frame {}, seen in {}, {}\n", name_of(e.kind), e.frame_index, e.seen_in,
               meters ? fmt::format("{:.3f} m off", *meters) : "without poses");
    ++joined;
    wrong += meters && *meters > kRight;
  }
  fmt::print("{} joins and loops, {} wrong\n", joined, wrong);
}

void print_maps(const SlamResult& result, const Judge& by) {
  print_events(result, by);
  Trajectory truth;
  for (std::size_t i = 0; i < by.truth.size(); ++i) {
    if (by.truth[i]) truth.push_back({static_cast<double>(i) / kFps, *by.truth[i]});
  }
  fmt::print("{} maps at the end; {} of {} frames with light have a pose, ATE of all {:.3f} m\n",
             result.maps, result.tracked(), truth.size(),
             absolute_trajectory_error(truth, result.trajectory).translation.rmse);
}

SlamOptions slam_options() {
  SlamOptions options;
  options.orb.keypoints = 600;
  options.dense_cloud = false;
  return options;
}

void take_estimates(const SlamResult& result, Judge& judge) {
  for (const StampedPose& p : result.trajectory) {
    judge.estimate.emplace(static_cast<std::size_t>(std::lround(p.timestamp * kFps)),
                           p.T_world_camera);
  }
}

/// Pieces of the way in no order, all but the last frames that make no whole one.
void scatter(int people) {
  const SimulatedSequence way = beside(SimulatedSequence(simulation()), people);
  Slam slam(way.camera(), slam_options());
  Judge judge;
  Tour tour(slam, judge);
  const std::size_t pieces = kHomeTo / kPiece;
  for (std::size_t i = 0; i < pieces; ++i) {
    tour.see(way, (i * 37) % pieces * kPiece, kPiece);
    tour.be_covered(way, kShortDark);
  }
  const SlamResult result = slam.finish();
  take_estimates(result, judge);
  print_maps(result, judge);
}

void run(int people) {
  const SimulatedSequence way(simulation()), other = beside(way, people);
  Slam slam(way.camera(), slam_options());
  Judge judge;
  Tour tour(slam, judge);
  tour.see(way, 0, kMapped);
  std::vector<Visit> places = visits();
  for (Visit& visit : places) {
    tour.be_covered(other);
    visit.first = tour.seen();
    tour.see(other, visit.from, kUncovered);
  }
  tour.be_covered(other);
  tour.see(way, kHomeFrom, kHomeTo - kHomeFrom);
  const SlamResult result = slam.finish();
  take_estimates(result, judge);
  print_places(places, result, judge);
  print_maps(result, judge);
  for (const StageTiming& stage : result.timing.stages()) {
    if (stage.name == "relocalization")
      fmt::print("relocalization: {:.1f} ms in the median, {:.1f} at most\n", stage.median,
                 stage.max);
  }
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  try {
    int people = 0;
    bool scattered = false;
    for (int i = 1; i < argc; ++i) {
      if (std::strcmp(argv[i], "--scattered") == 0) scattered = true;
      if (std::strcmp(argv[i], "--people") == 0 && i + 1 < argc) people = std::stoi(argv[i + 1]);
    }
    scattered ? stillmap::scatter(people) : stillmap::run(people);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
