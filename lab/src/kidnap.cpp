// SPDX-License-Identifier: Apache-2.0
/// Relocalization of a camera that was carried away while covered, and merging of its maps. Two
/// rooms of the simulated flat are mapped. Then the camera is, time after time, covered for three
/// seconds and uncovered elsewhere for two: at 20 places of those rooms, on a path shifted by 16
/// cm, and at 5 places of unknown rooms, where it begins new maps. Finally it is covered once more
/// and moves through the other rooms, past those 5 places, and back to the start. People walk about
/// while it is carried away. Printed per place: the number of frames until the first pose, whether
/// the place was recognized, and the error of the pose relative to the frames mapped nearby; at the
/// end, the numbers of recognized and wrong places and of merged maps.
///
/// --scattered: the whole path in pieces of two seconds, in random order, covered in between.
/// Nearly every piece begins a map, and overlapping pieces should be merged. Printed: the error of
/// every merge and loop, and the number of wrong ones.
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

constexpr double kFps = 15;
constexpr int kPathFrames = 2400;                   // one round through the flat
constexpr std::size_t kDark = 45, kUncovered = 30;  // frames
constexpr std::size_t kPiece = 30, kShortDark = 3;  // frames
constexpr std::size_t kOverlap = 100;               // frames that are mapped again on the way home
constexpr double kRight = 0.1;                      // a pose with a larger error is wrong [m]

struct KidnapArguments {
  int people = 0;
  std::size_t mapped = 1050;  ///< Number of frames mapped first: 28 m of the path, two rooms.
  std::size_t visits = 25;    ///< Number of places of uncovering; every fifth is unknown.
  std::size_t end = 2400;     ///< Frame of the path at which the sequence ends.
  bool scattered = false;     ///< Shows the path in pieces in random order.
  std::size_t pieces = 80;    ///< Number of pieces of the scattered path.
};

/// A place at which the camera is uncovered.
struct Visit {
  std::size_t from = 0;   ///< frame of the second path
  bool known = true;      ///< whether the place was mapped before
  std::size_t first = 0;  ///< index as pushed of the first uncovered frame
};

SimulationOptions simulation() {
  SimulationOptions options;
  options.scene = "flat";
  options.people = 0;
  options.camera = "loop";
  options.frames = kPathFrames;
  options.fps = kFps;
  options.width = 320;
  options.height = 240;
  return options;
}

/// Returns the same rooms on a path shifted by 16 cm, with another hand shake.
SimulatedSequence shifted(const SimulatedSequence& path, int people) {
  auto scene = std::make_shared<Scene>(make_scene({.scene = "flat", .people = people}));
  for (Eigen::Vector2f& corner : scene->round) corner += Eigen::Vector2f(0.1F, 0.12F);
  SimulationOptions options = path.options();
  options.seed = 77;
  options.frames = 3000;
  return {options, path.camera(), scene};
}

std::vector<Visit> visits(const KidnapArguments& arguments) {
  std::vector<Visit> made;
  std::size_t known = 0, unknown = 0;
  for (std::size_t i = 0; i < arguments.visits; ++i) {
    const bool is_known = i % 5 != 4;
    // Steps of 377 frames, coprime to 950, distribute the places over the path without order.
    const std::size_t at =
        is_known ? 20 + (known++ * 377) % (arguments.mapped - kOverlap) : 1280 + unknown++ * 190;
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
  std::optional<std::size_t> frames;  ///< uncovered frames before the first pose
  bool relocalized = false;
  double meters = 0;  ///< largest error of a pose since the place was recognized
};

/// Estimates and the truth, by index of the frames as pushed.
struct Judge {
  std::map<std::size_t, Pose> estimate;
  std::vector<std::optional<Pose>> truth;  ///< none while the camera was covered

  /// Returns the error of a frame relative to the frames mapped nearby before a visit, in the map
  /// that agrees best [m]. It is relative because the map as a whole may have drifted.
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

/// Pushes frames in the order in which the camera takes them, and records the truth.
class Tour {
 public:
  Tour(SlamSystem& slam, Judge& judge) : slam_(slam), judge_(judge) {}

  void see(const SimulatedSequence& path, std::size_t from, std::size_t count) {
    for (std::size_t i = from; i < from + count; ++i) {
      slam_.push(stamped(*path.frame(i), seen(), false));
      judge_.truth.emplace_back(path.T_world_camera(i));
    }
  }
  void be_covered(const SimulatedSequence& path, std::size_t count = kDark) {
    const RgbdFramePtr any = path.frame(0);
    for (std::size_t i = 0; i < count; ++i) {
      slam_.push(stamped(*any, seen(), true));
      judge_.truth.emplace_back();
    }
  }
  std::size_t seen() const { return judge_.truth.size(); }

 private:
  SlamSystem& slam_;
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
               j.relocalized ? fmt::format(", error {:.3f} m at most", j.meters) : "");
  }
  std::sort(waited.begin(), waited.end());
  fmt::print("{} of {} known places recognized, after {} frames (median), {} at most\n", recognized,
             known, waited.empty() ? 0 : waited[waited.size() / 2],
             waited.empty() ? 0 : waited.back());
  fmt::print("{} wrong\n", wrong);
}

const char* name_of(MapEvent::Kind kind) {
  if (kind == MapEvent::Kind::kLoop) return "loop";
  return kind == MapEvent::Kind::kMerge ? "maps joined" : "map dropped";
}

/// Returns the error of the relative pose of two matched frames [m]; none if one has no pose.
std::optional<double> relative_error(const Judge& by, std::size_t frame, std::size_t seen_in) {
  if (!by.estimate.contains(frame) || !by.estimate.contains(seen_in)) return std::nullopt;
  const Pose truth = by.truth[seen_in]->inverse() * *by.truth[frame];
  const Pose found = by.estimate.at(seen_in).inverse() * by.estimate.at(frame);
  return (truth.translation() - found.translation()).norm();
}

void print_events(const SlamResult& result, const Judge& by) {
  int joined = 0, wrong = 0;
  for (const MapEvent& e : result.events) {
    if (e.kind == MapEvent::Kind::kDropped) continue;
    const auto meters = relative_error(by, e.frame_index, e.seen_in);
    fmt::print("{}: frame {}, seen in {}, {}\n", name_of(e.kind), e.frame_index, e.seen_in,
               meters ? fmt::format("error {:.3f} m", *meters) : "without poses");
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
  fmt::print("{} maps at the end; {} of {} uncovered frames have a pose, ATE of all {:.3f} m\n",
             result.maps, result.tracked(), truth.size(),
             absolute_trajectory_error(truth, result.trajectory).translation.rmse);
}

SlamParameters slam_options() {
  SlamParameters options;
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

/// Pushes whole pieces of the path in random order, with the camera covered in between.
void scatter(const KidnapArguments& arguments) {
  const SimulatedSequence path = shifted(SimulatedSequence(simulation()), arguments.people);
  SlamSystem slam(path.camera(), slam_options());
  Judge judge;
  Tour tour(slam, judge);
  for (std::size_t i = 0; i < arguments.pieces; ++i) {
    tour.see(path, (i * 37) % arguments.pieces * kPiece, kPiece);
    tour.be_covered(path, kShortDark);
  }
  const SlamResult result = slam.finish();
  take_estimates(result, judge);
  print_maps(result, judge);
}

void carry_away(const KidnapArguments& arguments) {
  const SimulatedSequence path(simulation()), other = shifted(path, arguments.people);
  SlamSystem slam(path.camera(), slam_options());
  Judge judge;
  Tour tour(slam, judge);
  tour.see(path, 0, arguments.mapped);
  std::vector<Visit> places = visits(arguments);
  for (Visit& visit : places) {
    tour.be_covered(other);
    visit.first = tour.seen();
    tour.see(other, visit.from, kUncovered);
  }
  tour.be_covered(other);
  const std::size_t home = arguments.mapped - kOverlap;
  tour.see(path, home, arguments.end - home);
  const SlamResult result = slam.finish();
  take_estimates(result, judge);
  print_places(places, result, judge);
  print_maps(result, judge);
  for (const StageTiming& stage : result.timing.stages()) {
    if (stage.name == "relocalization")
      fmt::print("relocalization: {:.1f} ms (median), {:.1f} at most\n", stage.median, stage.max);
  }
}

void run(const KidnapArguments& arguments) {
  if (arguments.mapped <= kOverlap || arguments.end > kPathFrames ||
      arguments.end < arguments.mapped)
    throw Error("the frames are out of range", "kidnap", "take 100 < --mapped <= --end <= 2400");
  if (arguments.pieces * kPiece > kPathFrames || arguments.pieces == 0)
    throw Error("the pieces are out of range", "--pieces", "take 1 to 80");
  arguments.scattered ? scatter(arguments) : carry_away(arguments);
}

}  // namespace

void add_kidnap_command(CLI::App& app) {
  auto arguments = std::make_shared<KidnapArguments>();
  CLI::App* command = app.add_subcommand(
      "kidnap", "measure how a camera that was carried away is relocalized, and its maps merged");
  command->add_option("--people", arguments->people, "people who walk about")
      ->capture_default_str();
  command->add_option("--mapped", arguments->mapped, "frames that are mapped at first")
      ->capture_default_str();
  command->add_option("--visits", arguments->visits, "places at which the camera is uncovered")
      ->capture_default_str();
  command->add_option("--end", arguments->end, "frame of the path at which the way home ends")
      ->capture_default_str();
  command->add_flag("--scattered", arguments->scattered,
                    "the path in pieces of two seconds, in no order");
  command->add_option("--pieces", arguments->pieces, "number of these pieces")
      ->capture_default_str();
  command->callback([arguments] { run(*arguments); });
}

}  // namespace stillmap::lab
