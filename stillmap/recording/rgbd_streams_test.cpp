// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/rgbd_streams.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/recording/test_recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using test::Kind;
using test::TestCamera;
using test::TestFolder;
using test::TestMessage;
using ::testing::HasSubstr;

constexpr const char* kImage = "sensor_msgs/msg/Image";
constexpr const char* kCompressed = "sensor_msgs/msg/CompressedImage";
constexpr const char* kInfo = "sensor_msgs/msg/CameraInfo";

// A recording of named topics, with one image or message each.
class Topics {
 public:
  Topics& image(const std::string& topic, const std::string& encoding, const std::string& frame,
                int width = 8, int height = 6) {
    const TestCamera camera{.frame = frame};
    const int bytes = encoding == "rgb8" ? 3 : encoding == "mono8" ? 1 : 2;
    messages_.push_back({topic, kImage,
                         camera.image(1, 0, width, height, encoding, bytes,
                                      std::string(width * height * bytes, '\1')),
                         time_++});
    return *this;
  }
  Topics& compressed(const std::string& topic, const std::string& format, const std::string& frame,
                     const std::string& data = "x") {
    messages_.push_back({topic, kCompressed,
                         TestCamera{.frame = frame}.compressed_image(1, 0, format, data), time_++});
    return *this;
  }
  Topics& info(const std::string& topic, const std::string& frame, int width = 8, int height = 6,
               double shift = 0, const test::TestSettings& settings = {}) {
    messages_.push_back(
        {topic, kInfo,
         TestCamera{.frame = frame}.info(width, height, 10, "plumb_bob", {}, shift, settings),
         time_++});
    return *this;
  }
  Topics& transform(const std::string& parent, const std::string& child,
                    const std::vector<double>& numbers) {
    messages_.push_back({"/tf_static", "tf2_msgs/msg/TFMessage",
                         TestCamera().transform(parent, child, numbers), time_++});
    return *this;
  }
  RgbdStreams find(const std::string& topics = "") const {
    const TestFolder folder;
    Recording recording(folder.write("a.mcap", test::mcap_of(messages_, "cdr", "", 0, true)));
    return find_rgbd_streams(recording, topics);
  }

 private:
  std::vector<TestMessage> messages_;
  std::int64_t time_ = 1;
};

TEST(RgbdStreams, ColorAndRegisteredDepthAreChosenAmongOtherTopics) {
  Topics topics;
  topics.image("/camera/infra1/image_rect_raw", "mono8", "infra")
      .image("/camera/depth/image_rect_raw", "16UC1", "depth")
      .image("/camera/aligned_depth_to_color/image_raw", "16UC1", "color")
      .image("/camera/depth/colorized", "rgb8", "depth")
      .compressed("/camera/color/image_raw/compressed", "rgb8; jpeg compressed bgr8", "color")
      .image("/camera/color/image_raw", "rgb8", "color")
      .info("/camera/color/camera_info", "color");
  const RgbdStreams streams = topics.find();
  EXPECT_EQ(streams.color.name, "/camera/color/image_raw");
  EXPECT_EQ(streams.depth.name, "/camera/aligned_depth_to_color/image_raw");
  EXPECT_FALSE(streams.T_color_depth);
  ASSERT_TRUE(streams.color.camera);
  EXPECT_EQ(streams.color.camera->fx, 10);
  EXPECT_EQ(streams.depth_factor, 1000);
  EXPECT_EQ(streams.sensor, "realsense_d435i");
}

// Returns the topics that are chosen.
std::pair<std::string, std::string> names(const RgbdStreams& streams) {
  return {streams.color.name, streams.depth.name};
}

using Names = std::pair<std::string, std::string>;

TEST(RgbdStreams, ColorAndDepthOfOneCameraAreChosenByTheirNames) {
  Topics topics;
  // The depth of the rear camera has one image more.
  topics.image("/rear/depth/image_raw", "16UC1", "rear_depth_optical_frame")
      .image("/rear/depth/image_raw", "16UC1", "rear_depth_optical_frame")
      .image("/front/color/image_raw", "rgb8", "front_color_optical_frame")
      .image("/front/depth/image_raw", "16UC1", "front_depth_optical_frame")
      .image("/rear/color/image_raw", "rgb8", "rear_color_optical_frame");
  const RgbdStreams streams = topics.find();
  EXPECT_EQ(names(streams), Names("/front/color/image_raw", "/front/depth/image_raw"));
  EXPECT_THAT(streams.notes,
              ::testing::Contains(HasSubstr("to use it: --topics "
                                            "/rear/color/image_raw,/rear/depth/image_raw")));
}

TEST(RgbdStreams, CamerasThatAreNumberedAreToldApart) {
  for (const char* prefix : {"/camera", "/cam_", "/realsense/d435_", "/device_"}) {
    SCOPED_TRACE(prefix);
    const std::string one = prefix + std::string("1/sensor_"),
                      two = prefix + std::string("2/sensor_");
    Topics topics;
    topics.image(two + "0/Depth_0/image", "16UC1", "f")
        .image(two + "0/Depth_0/image", "16UC1", "f")
        .image(one + "1/Color_0/image", "rgb8", "f")
        .image(one + "1/Color_0/image", "rgb8", "f")
        .image(one + "0/Depth_0/image", "16UC1", "f");
    EXPECT_EQ(names(topics.find()), Names(one + "1/Color_0/image", one + "0/Depth_0/image"));
  }
}

TEST(RgbdStreams, OfSeveralCamerasTheOneWithTheMostImagesIsChosen) {
  Topics topics;
  for (const char* camera : {"/arm_a", "/head", "/head", "/arm_b"}) {
    topics.image(std::string(camera) + "/rgb/image", "rgb8", "")
        .image(std::string(camera) + "/depth/image", "16UC1", "");
  }
  const RgbdStreams streams = topics.find();
  EXPECT_EQ(names(streams), Names("/head/rgb/image", "/head/depth/image"));
  EXPECT_THAT(streams.notes,
              ::testing::IsSupersetOf({HasSubstr("/arm_a/rgb/image,/arm_a/depth/image"),
                                       HasSubstr("/arm_b/rgb/image,/arm_b/depth/image")}));
}

TEST(RgbdStreams, CamerasWithoutTellingNamesAreToldApartByTheirTransforms) {
  Topics topics;
  topics.image("/depth_a", "16UC1", "depth_a")
      .image("/depth_a", "16UC1", "depth_a")
      .image("/depth_b", "16UC1", "depth_b")
      .image("/color_x", "rgb8", "color_x")
      .transform("base", "color_x", {0.2, 0, 0, 0, 0, 0, 1})
      .transform("base", "depth_b", {0.22, 0, 0, 0, 0, 0, 1})
      .transform("base", "depth_a", {-0.2, 0, 0, 0, 1, 0, 0})
      .info("/camera_info", "depth_b");
  EXPECT_EQ(names(topics.find()), Names("/color_x", "/depth_b"));
}

TEST(RgbdStreams, DepthWithoutColorIsThatOfTheLeftInfraredImages) {
  Topics topics;
  topics.image("/camera/infra2/image_rect_raw", "mono8", "camera_infra2_optical_frame")
      .image("/camera/infra2/image_rect_raw", "mono8", "camera_infra2_optical_frame")
      .image("/camera/infra1/image_rect_raw", "mono8", "camera_infra1_optical_frame")
      .image("/camera/depth/image_rect_raw", "16UC1", "camera_depth_optical_frame");
  const RgbdStreams streams = topics.find();
  EXPECT_EQ(streams.color.name, "/camera/infra1/image_rect_raw");
  EXPECT_THAT(streams.notes, ::testing::Not(::testing::Contains(HasSubstr("another camera"))));
}

// The first bytes of a PNG file.
std::string png(int width, int height, int bits, int color_type) {
  const auto number = [](int value) {
    return std::string{0, 0, static_cast<char>(value >> 8), static_cast<char>(value)};
  };
  return std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16) + number(width) + number(height) +
         static_cast<char>(bits) + static_cast<char>(color_type) + std::string(7, '\0');
}

TEST(RgbdStreams, APngFileOf16BitsIsDepthWhateverItsFormatAndTopicSay) {
  for (const auto& [topic, format] :
       {std::pair("/camera/depth/image_raw/compressed", "png"),
        std::pair("/camera/depth", "bgr8; png compressed"),
        std::pair("/camera/depth/image_raw/compressedDepth", "16UC1; compressedDepth")}) {
    SCOPED_TRACE(topic);
    Topics topics;
    topics.compressed("/camera/color/image_raw/compressed", "png", "c", png(300, 200, 8, 2))
        .compressed(topic, format, "d", png(300, 200, 16, 0))
        .info("/camera/color/camera_info", "c", 300, 200);
    const RgbdStreams streams = topics.find();
    EXPECT_EQ(streams.depth.name, topic);
    EXPECT_EQ(streams.depth.encoding, "16UC1");
    EXPECT_EQ(streams.depth.storage, ImageStorage::kFile);
    EXPECT_EQ(streams.depth.width, 300);
    EXPECT_EQ(streams.color.height, 200);
  }
}

TEST(RgbdStreams, ACameraOfOtherImagesIsFittedAndTold) {
  const auto with = [](int width, int height, const test::TestSettings& settings) {
    Topics topics;
    topics.image("/c/rgb", "rgb8", "f").image("/c/depth", "16UC1", "f");
    return topics.info("/c/camera_info", "f", width, height, 0, settings).find().color;
  };
  const ImageStream scaled = with(16, 12, {});
  ASSERT_TRUE(scaled.camera);
  EXPECT_EQ(scaled.camera->fx, 5);
  EXPECT_EQ(scaled.camera_note, "camera of /c/camera_info: scaled from 16 x 12");
  EXPECT_THAT(with(20, 12, {.x = 2, .y = 3, .width = 8, .height = 6}).camera_note,
              HasSubstr("region of interest at (2, 3)"));
  const ImageStream rectified = with(8, 6, {.without_k = true});
  ASSERT_TRUE(rectified.camera);
  EXPECT_EQ(rectified.camera->fx, 20);
  EXPECT_THAT(rectified.camera_note, HasSubstr("K is 0, so P is used"));
  const ImageStream without_size = with(0, 0, {});
  ASSERT_TRUE(without_size.camera);
  EXPECT_EQ(without_size.camera->width, 8);
  EXPECT_THAT(without_size.camera_note, HasSubstr("its size is 0, so that of the images is used"));
  EXPECT_EQ(with(8, 6, {}).camera_note, "");
}

TEST(RgbdStreams, NamedTopicsArePreferred) {
  Topics topics;
  topics.image("/a/rgb", "rgb8", "f").image("/b/rgb", "rgb8", "f").image("/depth", "16UC1", "f");
  EXPECT_EQ(topics.find("/b/rgb,/depth").color.name, "/b/rgb");
  EXPECT_EQ(topics.find("a/rgb,depth").color.name, "/a/rgb");
  EXPECT_THAT(error_of([&] { topics.find("/b/rgb,/deth"); }), HasSubstr("did you mean '/depth'"));
  EXPECT_THAT(error_of([&] { topics.find("/b/rgb"); }), HasSubstr("COLOR,DEPTH"));
}

TEST(RgbdStreams, CompressedTopicsAreFound) {
  Topics topics;
  topics.compressed("/k/rgb/image_raw/compressed", "jpeg", "f")
      .compressed("/k/depth/image_raw/compressedDepth", "32FC1; compressedDepth png", "f")
      .info("/k/rgb/camera_info", "f");
  const RgbdStreams streams = topics.find();
  EXPECT_EQ(streams.color.storage, ImageStorage::kFile);
  EXPECT_EQ(streams.depth.storage, ImageStorage::kCompressedDepth);
  EXPECT_EQ(streams.depth.encoding, "32FC1");
  EXPECT_EQ(streams.color.width, 8);
}

TEST(RgbdStreams, TheTransformBetweenTheCamerasIsAChainOfRecordedOnes) {
  Topics topics;
  topics.image("/color/image", "rgb8", "color", 12, 10).info("/color/camera_info", "color", 12, 10);
  topics.image("/depth/image", "16UC1", "depth").info("/depth/camera_info", "depth");
  EXPECT_THAT(error_of([&] { topics.find(); }), HasSubstr("record /tf_static"));
  const double s = std::sqrt(0.5);
  topics.transform("link", "color", {1, 0, 0, 0, 0, s, s})
      .transform("link", "depth", {1, 0.5, 0, 0, 0, 0, 1});
  const RgbdStreams streams = topics.find();
  ASSERT_TRUE(streams.T_color_depth);
  // The depth camera is 0.5 m along y of the link, which is x of the color camera.
  EXPECT_TRUE(streams.T_color_depth->translation().isApprox(Eigen::Vector3d(0.5, 0, 0), 1e-9));
  ASSERT_TRUE(streams.depth.camera);
}

TEST(RgbdStreams, AStereoPairHasThePoseThatTheProjectionOfTheRightCameraTells) {
  Topics topics;
  topics.image("/left/image_rect", "mono8", "left").info("/left/camera_info", "left");
  topics.image("/right/image_rect", "mono8", "right")
      .info("/right/camera_info", "right", 8, 6, -20 * 0.12);
  const RgbdStreams streams = topics.find("/left/image_rect,/right/image_rect");
  ASSERT_TRUE(streams.T_left_right);
  EXPECT_TRUE(streams.T_left_right->translation().isApprox(Eigen::Vector3d(0.12, 0, 0), 1e-12));
  EXPECT_EQ(streams.depth.name, "/right/image_rect");
  EXPECT_FALSE(streams.T_color_depth);
}

TEST(RgbdStreams, AStereoPairWithoutABaselineHasTheRecordedTransform) {
  Topics topics;
  topics.image("/left/image_raw", "mono8", "left").image("/right/image_raw", "rgb8", "right");
  const char* const pair = "/left/image_raw,/right/image_raw";
  EXPECT_THAT(error_of([&] { topics.find(pair); }),
              HasSubstr("no camera for the images of /left/image_raw"));
  topics.info("/left/camera_info", "left").info("/right/camera_info", "right");
  EXPECT_THAT(error_of([&] { topics.find(pair); }), HasSubstr("neither the baseline"));
  topics.transform("left", "right", {0.2, 0, 0, 0, 0, 0, 1});
  const RgbdStreams streams = topics.find(pair);
  ASSERT_TRUE(streams.T_left_right);
  EXPECT_TRUE(streams.T_left_right->translation().isApprox(Eigen::Vector3d(0.2, 0, 0), 1e-12));
}

TEST(RgbdStreams, TheCamerasOfAPairAreTurnedByTheInverseOfR) {
  CameraInfoMessage info;
  info.projection = {10, 0, 4, -5, 0, 10, 3, 0, 0, 0, 1, 0};
  EXPECT_FALSE(pose_in_pair(info, /*rectified=*/false));  // R is not filled in
  info.rectification = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  const auto T_pair_camera = pose_in_pair(info, /*rectified=*/false);
  ASSERT_TRUE(T_pair_camera);
  const Eigen::Vector3d p_camera(1, 2, 3), p_pair(-2 + 0.5, 1, 3);
  EXPECT_TRUE((*T_pair_camera * p_camera).isApprox(p_pair, 1e-12));
  EXPECT_EQ(pose_in_pair(info, /*rectified=*/true)->angle(), 0);
}

TEST(RgbdStreams, MissingImagesAreErrorsThatListTheTopics) {
  Topics topics;
  topics.image("/mono", "mono8", "f").image("/rgb", "rgb8", "f");
  EXPECT_THAT(error_of([&] { topics.find(); }),
              ::testing::AllOf(HasSubstr("no topic with depth images"),
                               HasSubstr("/mono (mono8), /rgb (rgb8)")));
  EXPECT_THAT(error_of([&] { Topics().info("/i", "f").find(); }),
              HasSubstr("no topic with color images"));
}

TEST(RgbdStreams, ExchangedTopicsAndOneNamedTwiceAreErrors) {
  Topics topics;
  topics.image("/rgb", "rgb8", "f").image("/depth", "16UC1", "f");
  EXPECT_THAT(error_of([&] { topics.find("/depth,/rgb"); }), HasSubstr("--topics /rgb,/depth"));
  EXPECT_THAT(error_of([&] { topics.find("/rgb,/rgb"); }), HasSubstr("names one topic twice"));
}

TEST(RgbdStreams, ImagesThatAreNoMessagesOfRosAreNamed) {
  const TestFolder folder;
  Recording recording(folder.write_sqlite("a.db3", {{"/i", "foxglove.CompressedImage", "x", 1}}));
  EXPECT_THAT(error_of([&] { find_rgbd_streams(recording); }),
              HasSubstr("/i has messages of type foxglove.CompressedImage"));
}

TEST(RgbdStreams, ImagesWithoutStampsHaveTheTimesOfTheirRecording) {
  std::vector<TestMessage> messages;
  for (int i = 0; i < 3; ++i) {
    const TestCamera camera{.frame = "f"};
    const auto time = 5'000'000'000 + i * 100'000'000;
    messages.push_back(
        {"/rgb", kImage, camera.image(0, 0, 2, 2, "rgb8", 3, std::string(12, 'c')), time});
    messages.push_back(
        {"/depth", kImage, camera.image(0, 0, 2, 2, "16UC1", 2, std::string(8, 'd')), time});
  }
  const TestFolder folder;
  Recording recording(folder.write_sqlite("a.db3", messages));
  const RgbdStreams streams = find_rgbd_streams(recording);
  EXPECT_EQ(streams.color.images[1].stamp, 5'100'000'000);
  EXPECT_EQ(streams.fps, 10);
}

}  // namespace
}  // namespace stillmap
