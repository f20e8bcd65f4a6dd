// SPDX-License-Identifier: Apache-2.0
// The presets of the papers and their baseline on rendered scenes with true detections: each test
// fails if the step of its paper is taken out.
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

struct Scene {
  std::shared_ptr<const SimulatedSequence> sequence;
  std::vector<SimulatedFrame> frames;
};

/// Returns a rendered office of 320 x 240 pixels, rendered once.
const Scene& scene(const std::string& activity, int people, const std::string& camera = "xyz",
                   int things = 0, double fps = 30) {
  static std::map<std::tuple<std::string, int, std::string, int, double>, Scene> made;
  Scene& s = made[{activity, people, camera, things, fps}];
  if (s.sequence) return s;
  s.sequence = std::make_shared<SimulatedSequence>(SimulationOptions{.people = people,
                                                                     .activity = activity,
                                                                     .things = things,
                                                                     .near_things = true,
                                                                     .camera = camera,
                                                                     .frames = 60,
                                                                     .fps = fps,
                                                                     .width = 320,
                                                                     .height = 240});
  for (std::size_t i = 0; i < s.sequence->frames(); ++i) s.frames.push_back(s.sequence->at(i));
  return s;
}

/// Returns the true objects of a frame, with masks or boxes. Objects other than people get the
/// class chair, a potentially moving one.
std::vector<Instance> true_objects(const TruthFrame& truth, bool masks) {
  std::vector<Instance> objects;
  for (const MoverTruth& mover : truth.movers) {
    const cv::Mat1b pixels = truth.instances == mover.id;
    const cv::Rect box = cv::boundingRect(pixels);
    if (box.area() < 50) continue;
    objects.push_back({.class_id = mover.id,
                       .class_name = mover.class_name == "person" ? "person" : "chair",
                       .box = box,
                       .mask = masks ? pixels(box).clone() : cv::Mat()});
  }
  return objects;
}

class TrueDetector final : public Detector {
 public:
  TrueDetector(const Scene& scene, bool masks) : scene_(scene), masks_(masks) {}
  std::vector<Instance> detect(const RgbdFrame& frame) override {
    return true_objects(scene_.frames[frame.index].truth, masks_);
  }
  std::string description() const override { return "the truth"; }
  const std::vector<std::string>& class_names() const override { return names_; }

 private:
  const Scene& scene_;
  bool masks_;
  std::vector<std::string> names_ = {"person", "chair"};
};

/// Keypoints of all frames by place, and the shares of them that a preset drops.
struct Share {
  int all = 0, dropped = 0;
  void add(bool is_dropped) {
    ++all;
    dropped += is_dropped ? 1 : 0;
  }
  double value() const { return static_cast<double>(dropped) / std::max(all, 1); }
};

struct Outcome {
  SlamResult result;
  double ate = 0;  // [m]
  Share on_people, on_chairs, around_people, around_chairs, elsewhere;
  std::vector<std::size_t> live_points;  // points of the live cloud after every tenth frame
  float lowest_log_odds = 0;             // of the landmarks at the end

  /// Adds the keypoints of a frame. "Around" is inside a box, but not on the object.
  void add(const Frame& frame, const TruthFrame& truth) {
    const auto objects = true_objects(truth, true);
    for (std::size_t i = 0; i < frame.features->size(); ++i) {
      const Keypoint& k = frame.features->keypoints[i];
      const cv::Point pixel(cvRound(k.u), cvRound(k.v));
      Share* place = &elsewhere;
      for (const Instance& object : objects) {
        if (!object.box.contains(pixel)) continue;
        const bool person = object.class_name == "person";
        if (object.mask.at<std::uint8_t>(pixel - object.box.tl()) != 0) {
          place = person ? &on_people : &on_chairs;
          break;
        }
        if (place == &elsewhere || person) place = person ? &around_people : &around_chairs;
      }
      place->add(frame.evidence.weight[i] <= 0);
    }
  }
};

struct Variant {
  std::string preset;
  std::vector<std::string> settings = {};  // on top of the preset's
  bool masks = true;
  std::size_t first = 0;  // frame from which keypoints are counted
};

Outcome run(const Scene& scene, const Variant& variant) {
  Options options = read_options(variant.preset);
  options.features.keypoints = 600;
  for (const std::string& setting : variant.settings) set_option(setting, options);
  SlamSystem slam(scene.sequence->camera(), parameters_of(options),
                  std::make_unique<TrueDetector>(scene, variant.masks));
  Outcome outcome;
  for (const SimulatedFrame& frame : scene.frames) {
    slam.push(frame.frame);
    const std::size_t index = frame.frame->index;
    if (index >= variant.first) outcome.add(*slam.newest()->frame, frame.truth);
    if (index % 10 == 9) outcome.live_points.push_back(slam.snapshot()->cloud->size());
  }
  outcome.result = slam.finish();
  outcome.ate = absolute_trajectory_error(scene.sequence->trajectory(), outcome.result.trajectory)
                    .translation.rmse;
  slam.map().for_each_landmark([&](const Landmark& landmark) {
    outcome.lowest_log_odds = std::min(outcome.lowest_log_odds, landmark.static_log_odds);
  });
  return outcome;
}

/// Returns the share of the cloud's points inside a person's box in any frame, more than 20 cm
/// above the floor and 5 cm in front of the true static surface of the first frame.
double ghosts(const Scene& scene, const SlamResult& result) {
  const Pose T_truth_world =
      scene.sequence->T_world_camera(0) * result.trajectory.front().T_world_camera.inverse();
  std::size_t inside = 0;
  for (const Eigen::Vector3f& point : result.dense.cloud.points) {
    const Eigen::Vector3d p = T_truth_world * point.cast<double>();
    const auto contains = [&](const MoverTruth& mover) {
      Eigen::AlignedBox3d middle = mover.box;
      middle.min() += 0.25 * mover.box.sizes();
      middle.max() -= 0.25 * mover.box.sizes();
      return middle.contains(p);
    };
    inside += std::ranges::any_of(scene.frames, [&](const SimulatedFrame& frame) {
      return std::ranges::any_of(frame.truth.movers, contains);
    });
  }
  return static_cast<double>(inside) / static_cast<double>(result.dense.cloud.size());
}

// The baseline.

TEST(OrbRgbd, DropsNothingAndBelievesEverything) {
  const Scene& walking = scene("walk", 3);
  const Outcome plain = run(walking, {"orb-rgbd"});
  EXPECT_EQ(plain.result.tracked(), 60U);
  ASSERT_GT(plain.on_people.all, 1000);
  EXPECT_EQ(plain.on_people.dropped + plain.elsewhere.dropped, 0);
  EXPECT_EQ(plain.lowest_log_odds, 0) << "no landmark loses credit for being seen through";
  EXPECT_EQ(plain.result.dense.voxels_removed, 0U);
  EXPECT_GT(ghosts(walking, plain.result), 0.01) << "people stay in the cloud";
}

TEST(OrbRgbd, DiffersFromStaticByTheEvidenceOfTheDepth) {
  const Scene& walking = scene("walk", 3);
  const Outcome plain = run(walking, {"orb-rgbd"}), ours = run(walking, {"static"});
  EXPECT_LT(ours.lowest_log_odds, -0.1F);
  EXPECT_LT(ours.ate, 0.03);
  EXPECT_GT(ours.result.dense.voxels_removed, 500U);
  EXPECT_LT(ghosts(walking, ours.result), 0.5 * ghosts(walking, plain.result));
}

// Paper 000: masks.

TEST(SegMask, DropsExactlyTheKeypointsInTheMasksOfTheirFrame) {
  const Outcome masked = run(scene("walk", 3), {"seg-mask"});
  EXPECT_EQ(masked.result.segmented, 60U);
  EXPECT_EQ(masked.result.tracked(), 60U);
  ASSERT_GT(masked.on_people.all, 1000);
  EXPECT_EQ(masked.on_people.value(), 1);
  EXPECT_EQ(masked.around_people.dropped + masked.elsewhere.dropped, 0);
}

TEST(SegMask, LateOrDilatedMasksDropOthers) {
  const Scene& walking = scene("walk", 3);
  const Outcome late = run(walking, {"seg-mask", {"network.every=3", "network.mask_delay=2"}});
  const Outcome dilated = run(walking, {"seg-mask", {"motion.mask_dilation=5"}});
  EXPECT_LT(late.on_people.value(), 1);
  EXPECT_GT(late.elsewhere.dropped + late.around_people.dropped, 0);
  EXPECT_EQ(dilated.on_people.value(), 1);
  EXPECT_GT(dilated.around_people.dropped, 0);
}

TEST(SegMask, IsAsAccurateAsWithoutPeopleAndTheBaselineIsNot) {
  const Outcome masked = run(scene("walk", 3), {"seg-mask"});
  const Outcome baseline = run(scene("walk", 3), {"orb-rgbd"});
  const Outcome empty = run(scene("walk", 0), {"orb-rgbd"});
  EXPECT_LT(masked.ate, empty.ate + 0.004);
  EXPECT_GT(baseline.ate, 2 * masked.ate);
}

TEST(SegMask, StitchesACloudWithoutPeopleWhileItRuns) {
  const Scene& walking = scene("walk", 3);
  const Outcome masked = run(walking, {"seg-mask"});
  const Outcome unmasked = run(walking, {"seg-mask", {"dense.excluded_classes=", "motion.cues="}});
  EXPECT_EQ(masked.result.dense.voxels_removed, 0U) << "by masks and not by votes";
  EXPECT_LT(ghosts(walking, masked.result), 0.1 * ghosts(walking, unmasked.result));
  ASSERT_EQ(masked.live_points.size(), 6U);
  EXPECT_GT(masked.live_points.front(), 0U);
  EXPECT_TRUE(std::ranges::is_sorted(masked.live_points));
  EXPECT_LT(masked.live_points.front(), masked.live_points.back());
}

// Paper 001: optical flow in boxes.

TEST(BoxFlow, DropsWhoMovesAndKeepsTheBackgroundOfTheirBoxes) {
  const Outcome flow = run(scene("walk", 3), {"box-flow", {}, false, 1});
  EXPECT_EQ(flow.result.segmented, 60U);
  EXPECT_EQ(flow.elsewhere.dropped, 0) << "outside all boxes nothing is tested";
  EXPECT_GT(flow.on_people.value(), 0.7);
  ASSERT_GT(flow.around_people.all, 1000);
  EXPECT_LT(flow.around_people.value(), 0.9) << "a system without the test drops all of them";
}

TEST(BoxFlow, TheBodyIsKnownByWhatMovedBefore) {
  const Scene& walking = scene("walk", 3);
  const Outcome with = run(walking, {"box-flow", {}, false, 1});
  const Outcome without = run(walking, {"box-flow", {"motion.box_flow_body=none"}, false, 1});
  EXPECT_GT(with.on_people.dropped, without.on_people.dropped);
}

TEST(BoxFlow, TestsPotentiallyMovingObjectsToo) {
  const Scene& pushed = scene("walk", 0, "xyz", 3);
  const Outcome with = run(pushed, {"box-flow", {}, false, 1});
  const Outcome without = run(pushed, {"box-flow", {"motion.potential_classes="}, false, 1});
  ASSERT_GT(with.on_chairs.all, 100);
  EXPECT_GT(with.on_chairs.value(), 0.4);
  EXPECT_EQ(without.on_chairs.dropped, 0);
}

TEST(BoxFlow, RegistersTheCloudsOfTheKeyframes) {
  const Scene& walking = scene("walk", 3);
  const auto views_of = [&](const std::string& method) {
    return run(walking, {"box-flow", {"dense.method=" + method}, false}).result.placed.views;
  };
  const auto registered = views_of("registered"), stitched = views_of("keyframes");
  ASSERT_EQ(registered.size(), stitched.size());
  ASSERT_GT(registered.size(), 2U);
  double most = 0;
  for (std::size_t i = 0; i < registered.size(); ++i) {
    const Pose moved = stitched[i].T_world_camera.inverse() * registered[i].T_world_camera;
    most = std::max(most, moved.translation().norm());
  }
  EXPECT_GT(most, 0.0005);
  EXPECT_LT(most, 0.05);
  const auto preset = run(walking, {"box-flow", {}, false}).result.placed.views;
  EXPECT_EQ(preset.back().T_world_camera.translation(),
            registered.back().T_world_camera.translation());
}

// Paper 002: high and low dynamics.

/// Number of the frame that decides about the first ten.
constexpr std::size_t kDecided = 10;

/// Returns the share of the frames from kDecided on that the gate judged highly dynamic.
double high_share(const Outcome& outcome) {
  Share high;
  for (std::size_t i = kDecided; i < outcome.result.frames.size(); ++i)
    high.add(outcome.result.frames[i].dynamics == Dynamics::kHigh);
  return high.value();
}

TEST(GatedSeg, KeepsPeopleWhoSitWhileTheCameraMovesAndDropsPeopleWhoWalk) {
  const Outcome sitting = run(scene("sit", 2), {"gated-seg", {}, true, kDecided});
  ASSERT_GT(sitting.on_people.all, 1000);
  EXPECT_LT(sitting.on_people.value(), 0.3);
  EXPECT_LT(high_share(sitting), 0.3);
  const Outcome walking = run(scene("walk", 4), {"gated-seg", {}, true, kDecided});
  ASSERT_GT(walking.on_people.all, 1000);
  EXPECT_GT(walking.on_people.value(), 0.5);
  EXPECT_EQ(walking.elsewhere.dropped, 0);
  EXPECT_GT(high_share(walking), 0.4);
}

TEST(GatedSeg, TheTransformationInSe2TakesParallaxForMotion) {
  const Scene& still = scene("walk", 0, "halfsphere", 0, 10);
  const Outcome homography = run(still, {"gated-seg"});
  const Outcome se2 = run(still, {"gated-seg", {"motion.gate_transform=se2"}});
  EXPECT_LT(high_share(homography), 0.3);
  EXPECT_GT(high_share(se2), high_share(homography) + 0.3);
}

TEST(GatedSeg, ErasesRepeatedLandmarksAndKeepsTheMap) {
  const Scene& walking = scene("walk", 3);
  const Outcome with = run(walking, {"gated-seg"});
  const Outcome without = run(walking, {"gated-seg", {"map.landmark_rules="}});
  const Outcome all = run(walking, {"gated-seg", {"map.landmark_rules=repeated-all-pairs"}});
  EXPECT_FALSE(with.result.refined.repeated.empty());
  EXPECT_TRUE(without.result.refined.repeated.empty());
  EXPECT_GT(all.result.refined.repeated.size(), 3 * with.result.refined.repeated.size());
  EXPECT_LT(with.ate, 1.1 * without.ate + 0.001);
}

// Paper 003: epipolar lines.

TEST(BoxEpipolar, DropsPeopleTestsChairsAndKeepsTheRest) {
  const Scene& pushed = scene("walk", 2, "xyz", 3);
  const Outcome tested = run(pushed, {"box-epipolar", {}, false, 1});
  EXPECT_EQ(tested.on_people.value(), 1);
  EXPECT_EQ(tested.around_people.value(), 1) << "whole boxes";
  ASSERT_GT(tested.on_chairs.all, 100);
  EXPECT_GT(tested.on_chairs.value(), 0.15) << "those off their epipolar line";
  EXPECT_LT(tested.on_chairs.value(), 1);
  EXPECT_EQ(tested.elsewhere.dropped, 0) << "static objects and unrecognized surroundings";
}

TEST(BoxEpipolar, TheWidenedTestDropsBackgroundToo) {
  const Scene& pushed = scene("walk", 2, "xyz", 3);
  const Outcome widened =
      run(pushed, {"box-epipolar", {"motion.cues=epipolar-everywhere"}, false, 1});
  EXPECT_GT(widened.elsewhere.dropped, 10);
}

// All of them.

TEST(PaperPresets, AreNotWorseThanTheirBaselineWherePeopleWalk) {
  const Scene& walking = scene("walk", 3);
  const double baseline = run(walking, {"orb-rgbd"}).ate;
  for (const char* name : {"seg-mask", "gated-seg"})
    EXPECT_LT(run(walking, {name}).ate, 1.1 * baseline) << name;
  for (const char* name : {"box-flow", "box-epipolar"})
    EXPECT_LT(run(walking, {name, {}, false}).ate, 1.1 * baseline) << name;
}

TEST(PaperPresets, ShareTheSurroundingsOfTheirPapers) {
  for (const char* name : {"seg-mask", "box-flow", "gated-seg", "box-epipolar", "orb-rgbd"}) {
    const SlamParameters parameters = parameters_of(read_options(name));
    EXPECT_FALSE(parameters.tracker.erase_seen_through) << name;
    EXPECT_FALSE(parameters.final_adjustment) << name;
    EXPECT_FALSE(parameters.smooth_trajectory) << name;
    EXPECT_FALSE(parameters.dense.evidence.remove_ghosts) << name;
    EXPECT_FALSE(MotionEstimator(parameters.motion).needs_pose()) << "labels come first " << name;
    if (std::string(name) == "orb-rgbd") continue;
    EXPECT_EQ(parameters.schedule.segment_every, 1) << name;
    EXPECT_EQ(parameters.schedule.mask_delay, 0) << name;
    EXPECT_EQ(parameters.motion.semantic.dilation, name[0] == 'b' ? 5 : 0) << name;
    EXPECT_EQ(parameters.dense.back_projection.mask_dilation, 0) << name;
  }
}

}  // namespace
}  // namespace stillmap
