// SPDX-License-Identifier: Apache-2.0
// Tests of the dense map of a whole run: people are left out, static objects are found.
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/segment/mask_folder.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Smallest box of a detected monitor [pixels].
constexpr int kSmallest = 100;

/// Detects people by their true masks, and the scene's monitors as boxes of class tv.
class OfficeDetector final : public Detector {
 public:
  explicit OfficeDetector(std::shared_ptr<const SimulatedSequence> sequence)
      : sequence_(std::move(sequence)) {}

  std::vector<Instance> detect(const RgbdFrame& frame) override {
    const TruthFrame truth = sequence_->truth(frame.index);
    std::vector<Instance> found = instances_of_mask(class_mask(truth));
    for (const auto& object : sequence_->scene().statics.things) {
      if (object.class_name != "tv") continue;
      const cv::Rect box = seen(object.box.cast<double>(), truth);
      if (box.area() > kSmallest) {
        found.push_back(
            {.class_id = 62, .class_name = "tv", .confidence = 0.7F, .box = box, .mask = {}});
      }
    }
    return found;
  }
  std::string description() const override { return "the truth"; }
  const std::vector<std::string>& class_names() const override { return names_; }

  /// Returns the image box [pixels] of a box in the world, empty unless all of it is in view and
  /// its center is not occluded.
  cv::Rect seen(const Eigen::AlignedBox3d& box, const TruthFrame& truth) const {
    const Camera& camera = sequence_->camera();
    const Pose T_camera_world = truth.T_world_camera.inverse();
    Eigen::AlignedBox2d image;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d p =
          T_camera_world * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
      if (p.z() < 0.3) return {};
      image.extend(camera.project(p));
    }
    if (!camera.contains(image.min().x(), image.min().y()) ||
        !camera.contains(image.max().x(), image.max().y())) {
      return {};
    }
    const cv::Rect rect(cv::Point(cvRound(image.min().x()), cvRound(image.min().y())),
                        cv::Point(cvRound(image.max().x()), cvRound(image.max().y())));
    const double middle = truth.depth.at<float>(rect.y + rect.height / 2, rect.x + rect.width / 2);
    const double expected = (T_camera_world * box.center()).z();
    return std::abs(middle - expected) < 0.3 ? rect : cv::Rect();
  }

 private:
  std::shared_ptr<const SimulatedSequence> sequence_;
  std::vector<std::string> names_ = {"person", "unknown", "tv"};
};

struct Office {
  std::shared_ptr<const SimulatedSequence> sequence;
  std::vector<RgbdFramePtr> frames;
};

const Office& office() {
  static const Office made = [] {
    SimulationOptions options;
    options.people = 2;
    options.activity = "sit";
    options.frames = 60;
    options.width = 320;
    options.height = 240;
    Office o;
    o.sequence = std::make_shared<SimulatedSequence>(options);
    for (std::size_t i = 0; i < o.sequence->frames(); ++i) o.frames.push_back(o.sequence->frame(i));
    return o;
  }();
  return made;
}

SlamResult run_office() {
  SlamParameters options;
  options.orb.keypoints = 600;
  options.dense.back_projection.stride = 1;  // the images are small
  SlamSystem slam(office().sequence->camera(), options,
                  std::make_unique<OfficeDetector>(office().sequence));
  for (const RgbdFramePtr& frame : office().frames) slam.push(frame);
  return slam.finish();
}

/// Returns the number of frames in which a monitor is detected.
int detections_of(const Eigen::AlignedBox3d& monitor) {
  const OfficeDetector detector(office().sequence);
  int count = 0;
  for (const RgbdFramePtr& frame : office().frames) {
    count += detector.seen(monitor, office().sequence->truth(frame->index)).area() > kSmallest;
  }
  return count;
}

Pose T_truth_world(const SlamResult& result) {
  return office().sequence->T_world_camera(0) * result.trajectory.front().T_world_camera.inverse();
}

TEST(SlamDense, LeavesOutPeopleWhoSitStill) {
  const SlamResult result = run_office();
  ASSERT_GT(result.dense.cloud.size(), 5000U);
  const Pose T = T_truth_world(result);
  // Only the upper parts of sitting people are tested, since their lower parts contain chairs.
  std::size_t inside = 0;
  for (const MoverTruth& person : office().sequence->movers(30)) {
    Eigen::AlignedBox3d box = person.box;
    box.min().z() = box.max().z() - 0.45;
    for (const Eigen::Vector3f& p : result.dense.cloud.points) {
      inside += box.contains(T * p.cast<double>());
    }
  }
  EXPECT_LT(inside, result.dense.cloud.size() / 1000);
}

TEST(SlamDense, FindsMonitorsAtTheirTruePositions) {
  const SlamResult result = run_office();
  const Pose T = T_truth_world(result);
  const auto& true_objects = office().sequence->scene().statics.things;
  ASSERT_FALSE(result.dense.semantics.empty());
  ASSERT_EQ(result.dense.semantics.object.size(), result.dense.cloud.size());
  constexpr int kMostFrames = 40;  // of 60
  std::size_t found_of_detected = 0;
  std::ptrdiff_t found_of_certain = 0;
  for (const auto& true_object : true_objects) {
    if (true_object.class_name != "tv") continue;
    Eigen::AlignedBox3d box = true_object.box.cast<double>();
    box.min().array() -= 0.1;
    box.max().array() += 0.1;
    const auto here = [&](const StaticObject& object) { return box.contains(T * object.center); };
    const auto& objects = result.dense.semantics.objects;
    const auto found = std::count_if(objects.begin(), objects.end(), here);
    const int detections = detections_of(true_object.box.cast<double>());
    EXPECT_LE(found, detections > 0 ? 1 : 0) << detections;
    found_of_certain += detections > kMostFrames ? found : 0;
    found_of_detected += static_cast<std::size_t>(found);
  }
  EXPECT_EQ(found_of_certain, 2) << "two monitors are in view all the time";
  EXPECT_EQ(found_of_detected, result.dense.semantics.objects.size())
      << "every object is a monitor at its place";
  for (const StaticObject& object : result.dense.semantics.objects)
    EXPECT_EQ(object.class_name, "tv");
}

TEST(SlamDense, GivesTheSameMapTwice) {
  const SlamResult a = run_office(), b = run_office();
  EXPECT_EQ(a.dense.cloud, b.dense.cloud);
  EXPECT_EQ(a.dense.semantics.object, b.dense.semantics.object);
  EXPECT_EQ(a.dense.semantics.confidence, b.dense.semantics.confidence);
}

}  // namespace
}  // namespace stillmap
