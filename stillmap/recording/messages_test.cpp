// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/messages.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/recording/camera_model.hpp"
#include "stillmap/recording/test_recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::Kind;
using test::TestCamera;

class Messages : public ::testing::TestWithParam<Kind> {
 protected:
  std::string encoding() const { return GetParam() == Kind::kRos1 ? "ros1" : "cdr"; }
  static ByteSpan span(const std::string& bytes) {
    return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
  }
  // An odd length moves what follows off its natural alignment.
  TestCamera camera() const { return {.kind = GetParam(), .frame = "/frame"}; }
};

TEST_P(Messages, ImagesAreDecoded) {
  const std::string bytes = camera().image(12, 345, 5, 2, "rgb8", 3, std::string(30, 'p'));
  const ImageMessage image = decode_image(span(bytes), encoding());
  EXPECT_EQ(image.header.stamp, 12'000'000'345);
  EXPECT_EQ(image.header.frame, "frame");
  EXPECT_EQ(image.width, 5U);
  EXPECT_EQ(image.height, 2U);
  EXPECT_EQ(image.encoding, "rgb8");
  EXPECT_EQ(image.step, 15U);
  EXPECT_EQ(ByteCursor::as_text(image.data), std::string(30, 'p'));
}

TEST_P(Messages, CompressedImagesCamerasAndTransformsAreDecoded) {
  const auto image = camera().compressed_image(1, 2, "jpeg", "data");
  const auto decoded = decode_compressed_image(span(image), encoding());
  EXPECT_EQ(decoded.format, "jpeg");
  EXPECT_EQ(ByteCursor::as_text(decoded.data), "data");

  const auto bytes = camera().info(640, 480, 525, "plumb_bob", {0.1, 0, 0, 0, 0.2});
  const auto info = decode_camera_info(span(bytes), encoding());
  const auto recorded = camera_of(info, false);
  ASSERT_TRUE(recorded);
  EXPECT_EQ(recorded->width, 640);
  EXPECT_EQ(recorded->fx, 525);
  EXPECT_EQ(recorded->cx, 319.5);
  EXPECT_EQ(recorded->lens.coefficients, (std::vector<double>{0.1, 0, 0, 0, 0.2}));
  const auto rectified = camera_of(info, true);  // by the projection matrix
  EXPECT_EQ(rectified->fx, 1050);
  EXPECT_TRUE(rectified->lens.coefficients.empty());

  const auto tf = camera().transform("/base", "camera", {1, 2, 3, 0, 0, 1, 0});
  const auto transforms = decode_transforms(span(tf), encoding());
  ASSERT_EQ(transforms.size(), 1U);
  EXPECT_EQ(transforms[0].parent, "base");
  EXPECT_EQ(transforms[0].child, "camera");
  EXPECT_EQ(transforms[0].T_parent_child.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(
      (transforms[0].T_parent_child * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, 2, 3)));
}

TEST_P(Messages, EveryPrefixOfAMessageIsAnError) {
  const auto image = camera().image(12, 345, 5, 2, "rgb8", 3, std::string(30, 'p'));
  const auto info = camera().info(640, 480, 525, "plumb_bob", {0.1, 0, 0, 0, 0.2});
  const auto tf = camera().transform("base", "camera", {1, 2, 3, 0, 0, 1, 0});
  for (std::size_t n = 0; n < image.size(); ++n)
    EXPECT_THROW(decode_image(span(image).first(n), encoding()), Error) << n;
  const std::size_t used = info.size() - 1;  // The last flag is not read.
  for (std::size_t n = 0; n < used; ++n)
    EXPECT_THROW(decode_camera_info(span(info).first(n), encoding()), Error) << n;
  for (std::size_t n = 0; n < tf.size(); ++n)
    EXPECT_THROW(decode_transforms(span(tf).first(n), encoding()), Error) << n;
}

TEST_P(Messages, AnImageWithFewerPixelsThanItsSizeIsAnError) {
  const auto bytes = camera().image(1, 2, 5, 2, "rgb8", 3, std::string(29, 'p'));
  EXPECT_THROW(decode_image(span(bytes), encoding()), Error);
}

INSTANTIATE_TEST_SUITE_P(Encodings, Messages,
                         ::testing::Values(Kind::kRos1, Kind::kLittleCdr, Kind::kBigCdr));

TEST(CameraModel, OnlyKnownDistortionIsAccepted) {
  CameraInfoMessage info;
  info.width = 640;
  info.height = 480;
  info.distortion_model = "fancy";
  info.intrinsics = {500, 0, 320, 0, 500, 240, 0, 0, 1};
  EXPECT_TRUE(camera_of(info, false)->lens.coefficients.empty());
  info.distortion = {0.1};
  EXPECT_THROW(camera_of(info, false), Error);
  info.distortion_model = "rational_polynomial";
  info.distortion = {0.1, 0, 0, 0, 0, 0.1, 0, 0};
  EXPECT_EQ(camera_of(info, false)->lens.coefficients.size(), 8U);
  info.distortion_model = "equidistant";
  info.distortion = {0.1, 0, 0, 0};
  EXPECT_EQ(camera_of(info, false)->lens.model, LensDistortion::Model::kFisheye);
  info.intrinsics[0] = 0;
  EXPECT_EQ(camera_of(info, false), std::nullopt);
  info.intrinsics[0] = std::nan("");
  EXPECT_THROW(camera_of(info, false), Error);
}

// Sensor of 1280 x 960 pixels, f 1000.
CameraInfoMessage large_camera() {
  CameraInfoMessage info;
  info.width = 1280;
  info.height = 960;
  info.intrinsics = {1000, 0, 639.5, 0, 1000, 479.5, 0, 0, 1};
  return info;
}

TEST(CameraModel, BinningAndRegionOfInterestGiveTheCameraOfTheImages) {
  CameraInfoMessage info = large_camera();
  info.binning_x = info.binning_y = 2;
  const SizedCamera binned = sized(*camera_of(info, false), info, 640, 480);
  EXPECT_EQ(binned.how, "binned by 2 x 2");
  EXPECT_EQ(binned.camera.fx, 500);
  EXPECT_EQ(binned.camera.cx, 319.5);
  info.roi_x = 100;
  info.roi_y = 60;
  info.roi_width = 800;
  info.roi_height = 600;
  const SizedCamera part = sized(*camera_of(info, false), info, 400, 300);
  EXPECT_EQ(part.how, "region of interest at (100, 60), binned by 2 x 2");
  // Pixel (639.5, 479.5) of the full image is pixel (539.5, 419.5) of the part.
  EXPECT_EQ(part.camera.cx, (539.5 + 0.5) / 2 - 0.5);
  EXPECT_EQ(part.camera.cy, (419.5 + 0.5) / 2 - 0.5);
  EXPECT_EQ(part.camera.fy, 500);
  EXPECT_EQ(part.camera.height, 300);
  // Images of the full size are not binned, whatever the message says.
  EXPECT_EQ(sized(*camera_of(info, false), info, 1280, 960).camera.fx, 1000);
  EXPECT_EQ(sized(*camera_of(info, false), info, 0, 0).camera.width, 400);
}

TEST(CameraModel, ACameraOfTheSameRatioIsScaledAndOfAnotherIsNot) {
  const CameraInfoMessage info = large_camera();
  const SizedCamera half = sized(*camera_of(info, false), info, 640, 480);
  EXPECT_EQ(half.how, "scaled from 1280 x 960");
  EXPECT_EQ(half.camera.fx, 500);
  EXPECT_EQ(half.camera.cy, 239.5);
  EXPECT_EQ(half.camera.width, 640);
  const SizedCamera other = sized(*camera_of(info, false), info, 640, 360);
  EXPECT_EQ(other.how, "");
  EXPECT_EQ(other.camera.width, 1280);
}

TEST(CameraModel, WithoutKTheCameraIsPWithoutDistortion) {
  CameraInfoMessage info = large_camera();
  info.intrinsics = {};
  info.distortion_model = "plumb_bob";
  info.distortion = {0.1, 0, 0, 0, 0};
  EXPECT_EQ(camera_of(info, false), std::nullopt);
  info.projection = {900, 0, 640, 0, 0, 910, 480, 0, 0, 0, 1, 0};
  const auto camera = camera_of(info, false);
  ASSERT_TRUE(camera);
  EXPECT_EQ(camera->fy, 910);
  EXPECT_TRUE(camera->lens.coefficients.empty());
}

}  // namespace
}  // namespace stillmap
