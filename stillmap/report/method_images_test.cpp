#include "stillmap/report/method_images.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr int kWidth = 160, kHeight = 120, kStrip = 24;  // pixels
const cv::Vec3b kGreen(90, 220, 70), kRed(60, 60, 235);

/// A gray frame with keypoints on a row, of which those left of x = 80 move, and a person there.
FramePtr some_frame() {
  auto image = std::make_shared<RgbdFrame>();
  image->color = cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(128, 128, 128));
  image->gray = cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(128));
  image->depth = cv::Mat(kHeight, kWidth, CV_32FC1, cv::Scalar(2));
  auto features = std::make_shared<Features>();
  auto frame = std::make_shared<Frame>();
  for (int x = 20; x < kWidth; x += 20) {
    Keypoint keypoint;
    keypoint.u = static_cast<float>(x);
    keypoint.v = 60;
    features->keypoints.push_back(keypoint);
    frame->evidence.weight.push_back(x < 80 ? 0.0F : 1.0F);
  }
  features->descriptors.resize(features->keypoints.size());
  Instance person;
  person.class_name = "person";
  person.box = {10, 40, 60, 50};
  person.mask = cv::Mat(50, 60, CV_8UC1, cv::Scalar(0));
  person.mask.colRange(10, 50).setTo(255);
  frame->instances = std::make_shared<SegmentedFrame>(SegmentedFrame{0, 0, {person}});
  frame->image = image;
  frame->features = features;
  return frame;
}

std::ptrdiff_t count(const cv::Mat3b& image, const cv::Vec3b& color) {
  return std::count(image.begin(), image.end(), color);
}

TEST(ClassColor, DependsOnTheNameAlone) {
  EXPECT_EQ(class_color("person"), class_color("person"));
  EXPECT_NE(class_color("person"), class_color("chair"));
  EXPECT_NE(class_color("person"), class_color("tv"));
}

TEST(DrawObjects, FillsMasksAndOutlinesBoxesInTheColorOfTheClass) {
  const cv::Mat3b image = draw_objects(*some_frame());
  ASSERT_EQ(image.size(), cv::Size(kWidth, kHeight + kStrip));
  const cv::Scalar color = class_color("person");
  const cv::Vec3b own(static_cast<std::uint8_t>(color[0]), static_cast<std::uint8_t>(color[1]),
                      static_cast<std::uint8_t>(color[2]));
  EXPECT_EQ(image(80, 10), own) << "the left side of the box";
  const cv::Vec3b& in_mask = image(70, 40);
  const cv::Vec3b& in_box = image(70, 15);
  EXPECT_EQ(in_box, cv::Vec3b(128, 128, 128)) << "inside the box, outside the mask";
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(in_mask[i], 0.55 * 128 + 0.45 * own[i], 1.5) << i;
}

TEST(DrawObjects, SaysThatThereAreNone) {
  auto frame = std::make_shared<Frame>(*some_frame());
  frame->instances = nullptr;
  const cv::Mat3b image = draw_objects(*frame);
  EXPECT_EQ(count(image.rowRange(0, kHeight), {128, 128, 128}), kWidth * kHeight);
}

TEST(DrawFlow, DrawsMovingKeypointsRedAndEnlargesShortArrows) {
  const FramePtr frame = some_frame();
  KeypointFlow flow;
  for (const Keypoint& k : frame->features->keypoints) {
    flow.now.emplace_back(k.u, k.v);
    flow.before.emplace_back(k.u, k.v - 3);
    flow.found.push_back(1);
  }
  flow.found.back() = 0;
  const cv::Mat3b image = draw_flow(*frame, flow);
  EXPECT_EQ(image(60, 40), kRed);
  EXPECT_EQ(image(60, 100), kGreen);
  // Three pixels are drawn as twelve; lines have soft edges.
  constexpr double kSoft = 40;
  EXPECT_LT(cv::norm(image(50, 100) - kGreen), kSoft);
  EXPECT_GT(cv::norm(image(44, 100) - kGreen), kSoft);
  EXPECT_NE(image(60, 140), kGreen) << "a keypoint without flow";
}

TEST(DrawKeptKeypoints, HasAllOnTheLeftAndTheKeptOnesOnTheRight) {
  const cv::Mat3b image = draw_kept_keypoints(*some_frame());
  ASSERT_EQ(image.size(), cv::Size(2 * kWidth + 6, kHeight + kStrip));
  const cv::Mat3b left = image.colRange(0, kWidth), right = image.colRange(kWidth + 6, image.cols);
  EXPECT_GT(count(left, kRed), 0);
  EXPECT_EQ(count(right, kRed), 0);
  EXPECT_EQ(count(left, kGreen), count(right, kGreen));
}

TEST(DrawBlankedDepth, IsBlackWhereMoversWere) {
  const FramePtr frame = some_frame();
  cv::Mat1b movers(kHeight, kWidth, std::uint8_t{0});
  movers(cv::Rect(50, 30, 40, 40)).setTo(255);
  const cv::Mat3b image = draw_blanked_depth(*frame->image, movers);
  const cv::Mat3b left = image.colRange(0, kWidth), right = image.colRange(kWidth + 6, image.cols);
  EXPECT_NE(left(50, 70), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(right(50, 70), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(right(20, 20), left(20, 20));
}

TEST(DrawSparseMap, MarksDroppedPointsOnTheLeftOnly) {
  std::vector<Eigen::Vector3f> landmarks, dropped;
  for (int i = 0; i < 400; ++i) {
    const auto x = static_cast<float>(i % 20) * 0.1F, y = static_cast<float>(i / 20) * 0.1F;
    landmarks.emplace_back(x, y, 3.0F);
    if (i % 4 == 0) dropped.emplace_back(x, y, 2.5F);
  }
  const Trajectory cameras{
      {0, Pose()},
      {1, Pose(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(0.1, 0, 0))}};
  const cv::Mat3b image = draw_sparse_map(landmarks, dropped, "dropped points", cameras);
  const auto reddish = [](const cv::Mat3b& part) {
    return std::count_if(part.begin(), part.end(),
                         [](const cv::Vec3b& p) { return p[2] > 120 && p[1] < 100 && p[0] < 100; });
  };
  EXPECT_GT(reddish(image.colRange(0, 1000)), 100);
  EXPECT_EQ(reddish(image.colRange(1006, image.cols)), 0);
}

}  // namespace
}  // namespace stillmap
