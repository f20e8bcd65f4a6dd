// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_evidence.hpp"

#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Returns which raw depths a camera with disparities in eighths of a pixel can measure between
/// 0.5 and 6 m.
/// @param product  focal length times baseline [pixels m]
std::vector<bool> structured_light_levels(double factor, double product = 580 * 0.075) {
  std::vector<bool> seen(1 << 16);
  for (double disparity = 8 * product / 6; disparity < 8 * product / 0.5; ++disparity)
    seen[static_cast<std::uint16_t>(std::lround(factor * 8 * product / disparity))] = true;
  return seen;
}

DepthSensor kinect() { return find_depth_sensor("kinect_v1"); }

TEST(DepthFactorOfSteps, IsThatOfAStructuredLightCamera) {
  EXPECT_EQ(depth_factor_of_steps(structured_light_levels(5000), kinect()), 5000);
  EXPECT_EQ(depth_factor_of_steps(structured_light_levels(1000), kinect()), 1000);
  EXPECT_EQ(depth_factor_of_steps(structured_light_levels(10000), kinect()), 10000);
}

TEST(DepthFactorOfSteps, IsUnknownForOtherCameras) {
  std::vector<bool> millimeters(5000, true);
  EXPECT_FALSE(depth_factor_of_steps(millimeters, kinect()));
  // Stereo with 1/32 pixel: a factor between the common ones.
  EXPECT_FALSE(depth_factor_of_steps(structured_light_levels(1000, 640 * 0.05 * 4), kinect()));
  EXPECT_FALSE(depth_factor_of_steps({}, kinect()));
}

TEST(ByteOrderEvidence, FindsExchangedBytesOnly) {
  const auto found = [](const std::function<int(int)>& stored) {
    ByteOrderEvidence evidence;
    cv::Mat1f raw(240, 320);
    for (int y = 0; y < raw.rows; ++y) {
      for (int x = 0; x < raw.cols; ++x)
        raw(y, x) = static_cast<float>(stored(1500 + 3 * x + y + (x * x + 7 * y) % 5));
    }
    evidence.add(raw);
    return evidence.finding();
  };
  EXPECT_FALSE(found([](int z) { return z; }));
  EXPECT_FALSE(found([](int z) { return z / 8 * 256; })) << "eight bits";
  const auto finding = found([](int z) { return (z & 0xFF) << 8 | z >> 8; });
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->code, "depth-bytes");
}

TEST(EqualStep, IsThatOfAnImageOfEightBits) {
  std::vector<bool> bytes(1 << 16);
  for (int level = 30; level < 250; level += level % 7 == 0 ? 2 : 1)
    bytes[static_cast<std::size_t>(std::lround(level * 5000 * 10 / 255.0))] = true;
  EXPECT_NEAR(equal_step(bytes).value_or(0), 196.1, 0.5);
  EXPECT_FALSE(equal_step(structured_light_levels(5000)));
  EXPECT_FALSE(equal_step({}));
  bytes.resize(3000);
  EXPECT_FALSE(equal_step(bytes)) << "too few depths";
}

/// Rectangles at different depths, each with its own brightness and texture.
struct Collage {
  cv::Mat1b gray = cv::Mat1b(480, 640, std::uint8_t{90});
  cv::Mat1f depth = cv::Mat1f(480, 640, 3.0F);

  explicit Collage(unsigned seed) {
    std::mt19937 random(seed);
    const auto number = [&](int from, int to) {
      return from + static_cast<int>(random() % static_cast<unsigned>(to - from));
    };
    for (int i = 0; i < 40; ++i) {
      const cv::Rect box(number(-40, 600), number(-40, 440), number(40, 160), number(40, 160));
      cv::rectangle(gray, box, number(0, 255), cv::FILLED);
      cv::rectangle(depth, box, number(800, 2800) / 1000.0, cv::FILLED);
      const cv::Rect mark(box.x + 10, box.y + 10, 15, 10);  // texture that is no edge of an object
      cv::rectangle(gray, mark, number(0, 255), cv::FILLED);
    }
  }
};

template <typename Change>
RegistrationEvidence evidence(const Change& change) {
  RegistrationEvidence evidence(kinect());
  for (unsigned seed = 0; seed < 10; ++seed) {
    const Collage collage(seed);
    cv::Mat1f changed;
    change(collage.depth, changed);
    evidence.add(seed, collage.gray, changed);
  }
  return evidence;
}

TEST(RegistrationEvidence, AcceptsRegisteredDepth) {
  const auto registered = evidence([](const cv::Mat1f& in, cv::Mat1f& out) { out = in; });
  EXPECT_FALSE(registered.contradicts());
  EXPECT_LT(registered.fit().gain, 1.05);
}

TEST(RegistrationEvidence, FindsTheOffsetOfShiftedDepth) {
  const auto shifted = evidence([](const cv::Mat1f& in, cv::Mat1f& out) {
    const cv::Matx23d shift(1, 0, 12, 0, 1, -6);
    cv::warpAffine(in, out, shift, in.size(), cv::INTER_NEAREST);
  });
  EXPECT_TRUE(shifted.contradicts());
  for (const cv::Point offset : shifted.fit().offsets)
    EXPECT_LE(cv::norm(offset - cv::Point(-12, 6)), 2);
}

TEST(RegistrationEvidence, FindsTheDepthOfAnotherLens) {
  const auto larger = evidence([](const cv::Mat1f& in, cv::Mat1f& out) {
    const cv::Matx23d zoom(1.1, 0, -32, 0, 1.1, -24);  // as a Kinect's depth without registration
    cv::warpAffine(in, out, zoom, in.size(), cv::INTER_NEAREST);
  });
  EXPECT_TRUE(larger.contradicts());
  const auto offsets = larger.fit().offsets;  // toward the center, where the edges should be
  EXPECT_TRUE(offsets[0].x > 0 && offsets[0].y > 0) << offsets[0];
  EXPECT_TRUE(offsets[3].x < 0 && offsets[3].y < 0) << offsets[3];
}

TEST(RegistrationEvidence, FewFramesTellNothing) {
  RegistrationEvidence evidence(kinect());
  const auto add = [&](unsigned seed) {
    const Collage collage(seed);
    cv::Mat1f mirrored;
    cv::flip(collage.depth, mirrored, 1);
    evidence.add(seed, collage.gray, mirrored);
  };
  for (unsigned seed = 0; seed < 9; ++seed) add(seed);
  EXPECT_FALSE(evidence.finding());
  add(9);
  EXPECT_TRUE(evidence.finding());
}

TEST(RegistrationEvidence, FindsTurnedDepth) {
  const auto turned = [](int code) {
    return evidence([code](const cv::Mat1f& in, cv::Mat1f& out) { cv::flip(in, out, code); });
  };
  EXPECT_EQ(turned(1).turned(), "mirrored left to right");
  EXPECT_EQ(turned(0).turned(), "upside down");
  EXPECT_EQ(turned(-1).turned(), "turned by 180 degrees");
  EXPECT_EQ(evidence([](const cv::Mat1f& in, cv::Mat1f& out) { out = in; }).turned(), "");
}

/// Returns an image of weak noise, with strong noise in a part of it: a carpet.
cv::Mat1b carpet(const cv::Rect& part, unsigned seed) {
  cv::RNG random(seed);
  cv::Mat1b gray(480, 640);
  random.fill(gray, cv::RNG::UNIFORM, 100, 110);
  cv::Mat inside = gray(part & cv::Rect({}, gray.size()));
  random.fill(inside, cv::RNG::UNIFORM, 0, 255);
  return gray;
}

/// Returns depth with boxes in the upper half that no color image shows.
cv::Mat1f boxes_above(unsigned seed) {
  cv::RNG random(seed);
  cv::Mat1f depth(480, 640, 3.0F);
  for (int i = 0; i < 20; ++i)
    cv::rectangle(depth, {random.uniform(30, 550), random.uniform(30, 170), 50, 40},
                  random.uniform(0.8, 2.5), cv::FILLED);
  return depth;
}

TEST(RegistrationEvidence, TextureIsNoEvidenceOfATurnedImage) {
  RegistrationEvidence unregistered(kinect());
  for (unsigned seed = 0; seed < 20; ++seed)
    unregistered.add(seed, carpet({0, 240, 640, 240}, seed), boxes_above(seed));
  EXPECT_EQ(unregistered.turned(), "");
}

TEST(RegistrationEvidence, TextureIsNoEvidenceOfAnotherMoment) {
  RegistrationEvidence unregistered(kinect());
  for (int frame = 0; frame < 20; ++frame)
    unregistered.add(frame / 30.0, carpet({0, 12 * (20 - frame), 640, 480}, 1), boxes_above(2));
  EXPECT_EQ(unregistered.delay(), 0);
}

TEST(RegistrationEvidence, IgnoresEdgesWhereTheLensIsCovered) {
  RegistrationEvidence covered(kinect());
  for (unsigned seed = 0; seed < 20; ++seed) {
    Collage collage(seed);
    const int half = collage.gray.cols / 2;
    collage.gray.colRange(0, half + 40) = 0;
    collage.depth.colRange(half, collage.depth.cols) = 3;  // a wall with pictures
    covered.add(seed, collage.gray, collage.depth);
  }
  EXPECT_FALSE(covered.finding());
}

/// Returns the delay found of a camera that pans by 8 pixels per frame, 30 frames a second.
/// @param late  frames by which depth is late
double delay_of_panning_camera(int late) {
  RegistrationEvidence evidence(kinect());
  const Collage collage(1);
  const auto seen_at = [](const cv::Mat& scene, int frame) {
    return cv::Mat(scene, cv::Rect(100 + 8 * frame, 40, 320, 400));
  };
  for (int frame = 0; frame < 20; ++frame)
    evidence.add(frame / 30.0, seen_at(collage.gray, frame),
                 seen_at(collage.depth, std::max(0, frame - late)));
  return evidence.delay();
}

TEST(RegistrationEvidence, FindsDepthOfAnotherMoment) {
  EXPECT_EQ(delay_of_panning_camera(0), 0);
  EXPECT_NEAR(delay_of_panning_camera(2), -2 / 30.0, 1e-9);
  EXPECT_NEAR(delay_of_panning_camera(4), -4 / 30.0, 1e-9);
}

TEST(RegistrationEvidence, FindsDepthOfAnotherScene) {
  RegistrationEvidence other(kinect());
  for (unsigned seed = 0; seed < 20; ++seed) {
    EXPECT_FALSE(other.unrelated()) << "few frames may be blurred";
    other.add(seed, Collage(seed).gray, Collage(seed + 100).depth);
  }
  EXPECT_TRUE(other.unrelated());
  EXPECT_FALSE(evidence([](const cv::Mat1f& in, cv::Mat1f& out) { out = in; }).unrelated());
}

TEST(RegistrationEvidence, IsSilentWithoutEdges) {
  const auto flat =
      evidence([](const cv::Mat1f& in, cv::Mat1f& out) { out = cv::Mat1f(in.size(), 1.0F); });
  EXPECT_FALSE(flat.contradicts());
}

}  // namespace
}  // namespace stillmap
