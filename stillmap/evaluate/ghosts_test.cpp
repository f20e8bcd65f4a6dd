// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/ghosts.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <filesystem>
#include <fstream>
#include <memory>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kFrames = 40;
constexpr float kWall = 3.02F, kMover = 2.02F;  // depths [m]

Camera small_camera() {
  Camera camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 262;
  camera.cx = 159.5;
  camera.cy = 119.5;
  return camera;
}

Pose true_pose(int i) { return Pose(so3_exp({0, 0.001 * i, 0}), {0.002 * i, 0, 0}); }

Trajectory truth() {
  Trajectory trajectory;
  for (int i = 0; i < kFrames; ++i) trajectory.push_back({i / 30.0, true_pose(i)});
  return trajectory;
}

/// A wall z = 3 m in the world, and a board 80 x 120 pixels at a depth of 2 m that crosses the
/// image from left to right.
MaskedFrame frame(int i) {
  const Camera camera = small_camera();
  MaskedFrame frame{i / 30.0, cv::Mat(camera.height, camera.width, CV_32FC1),
                    cv::Mat::zeros(camera.height, camera.width, CV_8UC1)};
  const Pose T = true_pose(i);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d ray = T.quaternion() * camera.unproject(u, v, 1);
      frame.depth.at<float>(v, u) = static_cast<float>((kWall - T.translation().z()) / ray.z());
    }
  }
  const cv::Rect board(20 + 5 * i, 60, 80, 120);
  frame.depth(board) = kMover;
  frame.mask(board) = 255;
  return frame;
}

MaskedFrames all_frames() {
  return [i = 0]() mutable -> std::optional<MaskedFrame> {
    return i < kFrames ? std::optional(frame(i++)) : std::nullopt;
  };
}

/// Returns the points of the board or of the wall in one frame, in the world [m].
std::vector<Eigen::Vector3f> points_of_frame(int i, bool board) {
  const Camera camera = small_camera();
  const MaskedFrame f = frame(i);
  std::vector<Eigen::Vector3f> points;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      if ((f.mask.at<std::uint8_t>(v, u) != 0) != board) continue;
      const Eigen::Vector3d p = camera.unproject(u, v, f.depth.at<float>(v, u));
      points.push_back((true_pose(i) * p).cast<float>());
    }
  }
  return points;
}

std::vector<Eigen::Vector3f> wall_points() {
  std::vector<Eigen::Vector3f> points = points_of_frame(0, false);
  for (const auto& p : points_of_frame(kFrames - 1, false)) points.push_back(p);
  return points;
}

TEST(Ghosts, ThePointsOfTheMoverAreGhostsAndThoseOfTheWallAreNot) {
  const GhostReference reference = make_ghost_reference(all_frames(), truth(), small_camera());
  EXPECT_EQ(reference.frames, static_cast<std::size_t>(kFrames));
  const auto board = points_of_frame(kFrames / 2, true);
  const GhostFigures mover = count_ghosts(reference, board, Pose());
  EXPECT_EQ(mover.points, board.size());
  EXPECT_GT(mover.ghost_share(), 0.95);  // all but the board's outline, which is excluded
  const GhostFigures wall = count_ghosts(reference, wall_points(), Pose());
  EXPECT_EQ(wall.ghosts, 0u);
  EXPECT_GT(wall.surface_share(), 0.99);
}

TEST(Ghosts, AVoxelWithAStaticPixelIsNotSwept) {
  // The same scene with the crossing board marked static in one frame: its voxels are no longer
  // ghosts.
  int i = 0;
  const MaskedFrames frames = [&]() -> std::optional<MaskedFrame> {
    if (i == 2 * kFrames) return std::nullopt;
    MaskedFrame f = frame(i % kFrames);
    if (i++ >= kFrames) f.mask.setTo(0);
    return f;
  };
  const GhostReference reference = make_ghost_reference(frames, truth(), small_camera());
  EXPECT_LT(count_ghosts(reference, points_of_frame(kFrames / 2, true), Pose()).ghost_share(),
            0.02);
}

TEST(Ghosts, TheSurfaceKeptIsTheShareThatTheCloudCovers) {
  const GhostReference reference = make_ghost_reference(all_frames(), truth(), small_camera());
  std::size_t upper = 0;
  for (const auto& p : reference.surface) upper += p.y() < 0 ? 1 : 0;
  std::vector<Eigen::Vector3f> half = wall_points();
  std::erase_if(half, [](const auto& p) { return p.y() >= 0; });
  const GhostFigures figures = count_ghosts(reference, half, Pose());
  // One row of voxels more may lie within reach of the cut.
  const double row = 80.0 / static_cast<double>(reference.surface.size());
  EXPECT_NEAR(figures.surface_share(),
              static_cast<double>(upper) / static_cast<double>(reference.surface.size()), row);
  EXPECT_EQ(count_ghosts(reference, {}, Pose()).kept, 0u);
}

TEST(Ghosts, TheCloudsWorldIsAlignedWithTheTruths) {
  const GhostReference reference = make_ghost_reference(all_frames(), truth(), small_camera());
  const Pose T_truth_estimate(so3_exp({0.3, -0.8, 1.2}), {3, -2, 1});
  std::vector<Eigen::Vector3f> points = points_of_frame(kFrames / 2, true);
  for (auto& p : points) {
    p = (T_truth_estimate.inverse() * Eigen::Vector3d(p.cast<double>())).cast<float>();
  }
  EXPECT_GT(count_ghosts(reference, points, T_truth_estimate).ghost_share(), 0.95);
  EXPECT_LT(count_ghosts(reference, points, Pose()).ghost_share(), 0.05);
}

TEST(Ghosts, PixelsAtTheMasksOutlineCountNeitherWay) {
  // Masks that are 4 pixels too small would mark the mover's rim as static, and as the mover moves,
  // its rim covers the whole swept volume. The margin excludes the rim.
  const MaskedFrames frames = [i = 0]() mutable -> std::optional<MaskedFrame> {
    if (i == kFrames) return std::nullopt;
    MaskedFrame f = frame(i++);
    cv::erode(f.mask, f.mask, cv::Mat(), {-1, -1}, 4);
    return f;
  };
  const auto reference = make_ghost_reference(frames, truth(), small_camera());
  EXPECT_GT(count_ghosts(reference, points_of_frame(kFrames / 2, true), Pose()).ghost_share(), 0.8);
}

TEST(Ghosts, CountsFramesWithoutAPoseAndRefusesToWorkWithNone) {
  Trajectory part = truth();
  part.resize(10);
  const GhostReference reference = make_ghost_reference(all_frames(), part, small_camera());
  EXPECT_EQ(reference.frames, 10u);
  EXPECT_EQ(reference.frames_without_pose, kFrames - 10u);
  for (auto& pose : part) pose.timestamp += 1000;
  EXPECT_THROW(make_ghost_reference(all_frames(), part, small_camera()), Error);
}

TEST(Ghosts, RefusesFramesThatDoNotFitTheCamera) {
  Camera other = small_camera();
  other.width = 321;
  EXPECT_THROW(make_ghost_reference(all_frames(), truth(), other), Error);
}

TEST(Ghosts, PointsThatAreNotFiniteAreNoGhosts) {
  const GhostReference reference = make_ghost_reference(all_frames(), truth(), small_camera());
  const std::vector<Eigen::Vector3f> points{{NAN, 0, 0}, {INFINITY, 0, 0}, {1e30F, 0, 0}};
  const GhostFigures figures = count_ghosts(reference, points, Pose());
  EXPECT_EQ(figures.ghosts, 0u);
  EXPECT_EQ(figures.points, 3u);
  EXPECT_EQ(nlohmann::json(figures).at("points"), 3);
}

/// Source of the synthetic frames, like a sequence on disk.
class Frames : public FrameSource {
 public:
  const Camera& camera() const override { return camera_; }
  RgbdFramePtr next() override {
    if (next_ == kFrames) return nullptr;
    auto f = std::make_shared<RgbdFrame>();
    f->timestamp = next_ / 30.0;
    f->depth = frame(next_++).depth;
    return f;
  }
  std::optional<std::size_t> size() const override { return kFrames; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }

 private:
  Camera camera_ = small_camera();
  int next_ = 0;
  std::vector<SkippedFrame> skipped_;
};

class MaskFiles : public ::testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  const std::filesystem::path folder_ = test::own_path("masks");
};

TEST_F(MaskFiles, AreFoundByTheirStamps) {
  for (int i = 0; i < kFrames; i += 2) {
    write_png(folder_ / fmt::format("{:.6f}.png", i / 30.0), frame(i).mask);
  }
  Frames source;
  const MaskedFrames frames = frames_with_masks(source, folder_);
  int count = 0;
  while (const auto f = frames()) {
    EXPECT_EQ(cv::countNonZero(f->mask != frame(2 * count).mask), 0) << count;
    ++count;
  }
  EXPECT_EQ(count, kFrames / 2);
}

TEST_F(MaskFiles, MissingOrBrokenOnesAreNamed) {
  Frames source;
  EXPECT_THROW(frames_with_masks(source, folder_), Error);
  std::ofstream(folder_ / "0.000000.png") << "no image";
  const MaskedFrames frames = frames_with_masks(source, folder_);
  EXPECT_THROW(frames(), Error);
}

}  // namespace
}  // namespace stillmap
