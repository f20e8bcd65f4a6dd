// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/motion/test_frames.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Rect kObject(120, 80, 80, 80);  // image box of the object [pixels]

/// Consecutive frames, as in the pipeline.
class FrameSequence {
 public:
  explicit FrameSequence(const std::vector<std::string>& cues = MotionOptions().cues) {
    MotionOptions options;
    options.cues = cues;
    estimator_ = std::make_unique<MotionEstimator>(options);
  }

  /// A camera at rest with a wall at 3 m and optionally an object at 1.5 m.
  FramePtr next(bool object, const std::vector<Instance>& instances = {}) {
    cv::Mat1f depth(240, 320, 3.0F);
    if (object) depth(kObject) = 1.5F;
    return next(depth, Pose(), instances);
  }

  FramePtr next(const cv::Mat1f& depth, const Pose& T_world_camera,
                const std::vector<Instance>& instances = {}) {
    auto image = std::make_shared<RgbdFrame>();
    image->index = previous_ ? previous_->index() + 1 : 0;
    image->gray = cv::Mat::zeros(240, 320, CV_8UC1);
    image->depth = depth;
    auto features = std::make_shared<Features>();
    for (int y = 20; y < 240; y += 20) {
      for (int x = 20; x < 320; x += 20) {
        features->keypoints.push_back(
            {.u = static_cast<float>(x), .v = static_cast<float>(y), .depth = depth(y, x)});
      }
    }
    auto frame = std::make_shared<Frame>();
    frame->image = image;
    frame->features = features;
    frame->cells = std::make_shared<CellGrid>(depth, test::small_camera());
    auto segmented = std::make_shared<SegmentedFrame>();
    segmented->instances = instances;
    frame->instances = segmented;
    frame->instance_cells = instance_cells(segmented, *frame->cells);
    MotionInput input{.image = image,
                      .features = features,
                      .cells = frame->cells,
                      .instances = segmented,
                      .instance_cells = frame->instance_cells,
                      .previous = previous_,
                      .ego_motion = {}};
    if (previous_) input.ego_motion = ego_motion(T_world_camera, features->size());
    T_world_previous_ = T_world_camera;
    frame->evidence = masks_late_ ? evidence_with_late_masks(input) : estimator_->estimate(input);
    previous_ = frame;
    return frame;
  }

  void let_masks_come_late() { masks_late_ = true; }

  FramePtr after(int frames, bool object, const std::vector<Instance>& instances = {}) {
    for (int i = 1; i < frames; ++i) next(object, instances);
    return next(object, instances);
  }

 private:
  EgoMotion ego_motion(const Pose& T_world_camera, std::size_t keypoints) const {
    EgoMotion ego;
    ego.T_odometry_camera = T_world_camera;
    ego.T_odometry_previous = T_world_previous_;
    for (std::size_t i = 0; i < keypoints; ++i) ego.previous.push_back(static_cast<int>(i));
    ego.landmark_log_odds.assign(keypoints, 0.0F);
    return ego;
  }

  MotionEvidence evidence_with_late_masks(const MotionInput& input) const {
    MotionInput early = input;
    early.instances = nullptr;
    early.instance_cells = nullptr;
    return estimator_->finish(estimator_->begin(early), input);
  }

  std::unique_ptr<MotionEstimator> estimator_;
  FramePtr previous_;
  Pose T_world_previous_;
  bool masks_late_ = false;
};

struct ExcludedKeypoints {
  int inside = 0, outside = 0;
};

/// Returns the numbers of excluded keypoints inside and outside the object, not near its outline.
ExcludedKeypoints excluded(const Frame& frame) {
  const cv::Rect core(kObject.x + 8, kObject.y + 8, kObject.width - 16, kObject.height - 16);
  const cv::Rect rim(kObject.x - 8, kObject.y - 8, kObject.width + 16, kObject.height + 16);
  ExcludedKeypoints result;
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    if (frame.evidence.weight[i] > 0) continue;
    const cv::Point2f p(frame.features->keypoints[i].u, frame.features->keypoints[i].v);
    result.inside += core.contains(p);
    result.outside += !rim.contains(p);
  }
  return result;
}

Instance person() {
  Instance made = test::box_of("person", kObject);
  made.mask = cv::Mat(kObject.size(), CV_8UC1, cv::Scalar(255));
  return made;
}

constexpr int kInside = 9;  // number of keypoints inside the object, not near its outline

TEST(Fused, LabelsAnEmptyRoomAsStatic) {
  FrameSequence frames;
  const FramePtr frame = frames.after(20, false);
  EXPECT_EQ(excluded(*frame).outside, 0);
  EXPECT_TRUE(frame->evidence.moving_pixels.empty());
}

/// Returns the depth of a wall 3.4 m in front of the axis that a camera turns about, with an error
/// of its inverse that falls over the image by 0.03 / m, and optionally an object 0.6 m before it.
cv::Mat1f wall_before_a_turned_camera(double angle, bool object) {
  const Camera camera = test::small_camera();
  cv::Mat1f depth(camera.height, camera.width);
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const double x = (u - camera.cx) / camera.fx;
      const double distance = object && kObject.contains({u, v}) ? 2.8 : 3.4;
      const double inverse = (std::cos(angle) - x * std::sin(angle)) / distance;
      depth(v, u) = static_cast<float>(1 / (inverse - 0.03 * (u - camera.cx) / camera.width));
    }
  }
  return depth;
}

TEST(Fused, SmoothErrorsOfTheDepthAreNoMotion) {
  FrameSequence frames({"free-space", "surface", "history"});
  FramePtr frame;
  std::size_t moving = 0;
  constexpr double kTurn = 0.008;  // [rad] per frame
  for (int i = 0; i < 60; ++i) {
    const double angle = i * kTurn;
    frame = frames.next(
        wall_before_a_turned_camera(angle, false),
        Pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())), {0, 0, 0}));
    if (!frame->evidence.moving_pixels.empty())
      moving += static_cast<std::size_t>(cv::countNonZero(frame->evidence.moving_pixels));
  }
  EXPECT_EQ(moving, 0U);
  const double angle = 60 * kTurn;
  for (int i = 0; i < 3; ++i) {
    frame = frames.next(
        wall_before_a_turned_camera(angle, true),
        Pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())), {0, 0, 0}));
  }
  ASSERT_FALSE(frame->evidence.moving_pixels.empty());
  EXPECT_GT(cv::countNonZero(frame->evidence.moving_pixels(kObject)), 0.9 * kObject.area());
}

TEST(Fused, FindsAnObjectOfUnknownClassInFreeSpace) {
  FrameSequence frames;
  frames.after(20, false);
  const FramePtr frame = frames.after(3, true);
  EXPECT_EQ(excluded(*frame).inside, kInside);
  EXPECT_EQ(excluded(*frame).outside, 0);
  const cv::Mat& moving = frame->evidence.moving_pixels;
  EXPECT_NEAR(cv::countNonZero(moving), kObject.area(), 0.1 * kObject.area());
  EXPECT_NEAR(cv::countNonZero(moving(kObject)), kObject.area(), 0.1 * kObject.area());
}

TEST(Fused, WithoutResidualsAndFreeSpaceSuchAnObjectIsMissed) {
  FrameSequence frames({"surface", "history", "semantic"});
  frames.after(20, false);
  const FramePtr frame = frames.after(3, true);
  EXPECT_TRUE(frame->evidence.moving_pixels.empty());
}

TEST(Fused, LabelsAnObjectThatIsThereFromTheStartAsStatic) {
  FrameSequence frames;
  const FramePtr frame = frames.after(30, true);
  EXPECT_EQ(excluded(*frame).inside, 0);
}

TEST(Fused, ExcludesPeopleUntilTheyAreMeasuredToSitStill) {
  FrameSequence frames;
  const FramePtr first = frames.next(true, {person()});
  EXPECT_EQ(excluded(*first).inside, kInside);
  EXPECT_EQ(excluded(*first).outside, 0);
  const FramePtr later = frames.after(60, true, {person()});
  EXPECT_EQ(excluded(*later).inside, 0);
}

TEST(EvidenceOfClasses, ExcludesPeopleAndForgetsMeasurementsOfItsOwnOnly) {
  FrameSequence frames;
  frames.after(20, false);
  const FramePtr object = frames.after(3, true);
  const double measured = cv::norm(object->evidence.surface_measured),
               surfaces = cv::norm(object->evidence.surface_log_odds);
  Frame relabeled = *object;
  relabeled.evidence = evidence_of_classes(*object);
  EXPECT_EQ(excluded(relabeled).inside, 0) << "it is of no moving class";
  EXPECT_EQ(cv::norm(object->evidence.surface_measured), measured);
  EXPECT_EQ(cv::norm(object->evidence.surface_log_odds), surfaces);
  FrameSequence others;
  relabeled = *others.next(true, {person()});
  relabeled.evidence = evidence_of_classes(relabeled);
  EXPECT_EQ(excluded(relabeled).inside, kInside);
  EXPECT_EQ(excluded(relabeled).outside, 0);
}

TEST(Fused, IsTheSameForLateMasks) {
  FrameSequence at_once, late;
  late.let_masks_come_late();
  for (int i = 0; i < 12; ++i) {
    const MotionEvidence a = at_once.next(i > 5, {person()})->evidence;
    const MotionEvidence b = late.next(i > 5, {person()})->evidence;
    EXPECT_EQ(a.static_log_odds, b.static_log_odds) << i;
    EXPECT_EQ(a.weight, b.weight) << i;
    EXPECT_GT(std::count(b.weight.begin(), b.weight.end(), 0.0F), 0) << i;
  }
}

TEST(Spread, FollowsSurfacesAndStopsAtDepthEdges) {
  cv::Mat1f depth(240, 320, 2.0F);
  depth(cv::Rect(160, 0, 160, 240)) = 3.0F;
  const CellGrid grid(depth, test::small_camera());
  cv::Mat1f values = cv::Mat1f::zeros(grid.size());
  values(30, 38) = 1;  // two cells left of the edge
  const cv::Mat1f spread = SurfaceSpread(grid)(values);
  EXPECT_NEAR(spread(30, 38), 1, 1e-5);
  EXPECT_GT(spread(30, 36), 0.5);
  EXPECT_NEAR(spread(28, 38), spread(32, 38), 1e-5);
  EXPECT_LT(spread(30, 40), 1e-4);
}

TEST(Reprojection, ACameraAtRestSeesEveryCellInItsPlace) {
  const CellGrid grid(cv::Mat(cv::Mat1f(240, 320, 2.5F)), test::small_camera());
  int seen = 0;
  for_each_reprojected(grid, Reprojection(grid, Pose()),
                       [&](int r, int c, float z, int cell, float z2) {
                         EXPECT_EQ(r * grid.depth.cols + c, cell);
                         EXPECT_FLOAT_EQ(z, z2);
                         ++seen;
                       });
  EXPECT_EQ(seen, grid.depth.rows * grid.depth.cols);
}

TEST(Reprojection, AMovedCameraSeesTheCellsAtTheirProjections) {
  cv::Mat1f depth(240, 320, 2.5F);
  depth(cv::Rect(0, 0, 40, 40)) = 0;  // unknown
  depth(cv::Rect(160, 100, 60, 60)) = 0.3F;
  const CellGrid grid(cv::Mat(depth), test::small_camera());
  const Eigen::AngleAxisd turn(0.2, Eigen::Vector3d(0.1, 1, 0.2).normalized());
  const Pose T_other_camera(Eigen::Quaterniond(turn), Eigen::Vector3d(0.3, -0.2, -0.25));
  cv::Mat1i expected(grid.size(), -1), found(grid.size(), -1);
  for (int r = 0; r < grid.depth.rows; ++r) {
    for (int c = 0; c < grid.depth.cols; ++c) {
      if (grid.depth(r, c) <= 0) continue;
      const Eigen::Vector3d p = T_other_camera * grid.camera.unproject(c, r, grid.depth(r, c));
      if (p.z() < 0.1) continue;
      const Eigen::Vector2d uv = grid.camera.project(p);
      const cv::Point cell(cvRound(uv.x()), cvRound(uv.y()));
      if (!cv::Rect({}, grid.size()).contains(cell)) continue;
      expected(r, c) = cell.y * grid.depth.cols + cell.x;
    }
  }
  for_each_reprojected(
      grid, Reprojection(grid, T_other_camera), [&](int r, int c, float, int cell, float z) {
        found(r, c) = cell;
        const Eigen::Vector3d p = T_other_camera * grid.camera.unproject(c, r, grid.depth(r, c));
        EXPECT_NEAR(z, p.z(), 1e-5);
      });
  // A point between two cells may fall on either.
  EXPECT_LT(cv::countNonZero(expected != found), 5);
  EXPECT_GT(cv::countNonZero(expected >= 0), 2000);
  EXPECT_GT(cv::countNonZero(expected < 0), 500);
}

/// Returns the depths of a tilted plane whose rows a moving camera exposes one after the other.
CellGrid exposed(const Pose& T_world_camera, const Eigen::Matrix<double, 6, 1>& twist,
                 const ShutterTiming& timing) {
  const Camera camera = test::small_camera();
  const Eigen::Vector3d normal = Eigen::Vector3d(0.1, 0.5, 1).normalized();
  cv::Mat1f depth(camera.height, camera.width);
  for (int v = 0; v < depth.rows; ++v) {
    const double time = ((v + 0.5) / depth.rows - 0.5) * timing.readout + timing.depth_delay;
    const Pose T = T_world_camera * Pose::exp(time * twist);
    const Eigen::Vector3d n = T.rotation().transpose() * normal;
    const double d = 2.5 - normal.dot(T.translation());
    for (int u = 0; u < depth.cols; ++u)
      depth(v, u) = static_cast<float>(d / n.dot(camera.unproject(u, v, 1)));
  }
  return CellGrid(depth, camera);
}

TEST(Reprojection, CorrectsRowsThatAMovingCameraExposesAtOtherTimes) {
  const ShutterTiming timing{.readout = 0.03, .depth_delay = 0.012};
  Eigen::Matrix<double, 6, 1> twist, other_twist;  // [m/s, rad/s]
  twist << 0.3, -0.2, 0.1, 1.5, 0.3, -1;
  other_twist << -0.2, 0.3, -0.3, -1.2, 0.4, 1.5;
  const Pose T_world_other(so3_exp({0.05, -0.1, 0.03}), {0.05, 0.03, -0.02});
  const CellGrid grid = exposed(Pose(), twist, timing);
  const CellGrid other = exposed(T_world_other, other_twist, timing);
  const auto mean_error = [&](const ExposureMotion& motion, const ExposureMotion& other_motion) {
    double sum = 0;
    int count = 0;
    for_each_reprojected(grid, Reprojection(grid, T_world_other.inverse(), motion, other_motion),
                         [&](int, int, float, int cell, float z) {
                           sum += std::abs(other.depth(cell) - z);
                           ++count;
                         });
    EXPECT_GT(count, 3000);
    return sum / count;
  };
  EXPECT_LT(mean_error({twist, timing}, {other_twist, timing}), 0.008) << "rounded to cells";
  EXPECT_GT(mean_error({}, {}), 0.02);
  EXPECT_GT(mean_error({twist, timing}, {}), 0.014);
  EXPECT_GT(mean_error({}, {other_twist, timing}), 0.014);
}

}  // namespace
}  // namespace stillmap
