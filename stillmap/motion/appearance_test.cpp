// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/appearance.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Scalar kRed(40, 40, 180), kBlue(170, 60, 40), kGray(120, 122, 121), kGreen(50, 160, 60);

void add_pixels(Appearance& appearance, Appearance::Part part, const cv::Scalar& color, int seed) {
  cv::RNG random(static_cast<std::uint64_t>(seed));
  for (int i = 0; i < 500; ++i) {
    cv::Vec3b pixel;
    for (int c = 0; c < 3; ++c)
      pixel[c] = cv::saturate_cast<std::uint8_t>(color[c] + random.gaussian(4));
    appearance.add(part, pixel);
  }
}

/// Returns a person with a shirt and trousers of one color each, with noise.
Appearance person(const cv::Scalar& shirt, const cv::Scalar& trousers, int seed = 1) {
  Appearance appearance;
  add_pixels(appearance, Appearance::Part::kUpper, shirt, seed);
  add_pixels(appearance, Appearance::Part::kLower, trousers, seed);
  return appearance;
}

TEST(Appearance, IsAlikeForOneObjectUnderNoiseAndOtherLight) {
  const Appearance a = person(kRed, kBlue);
  EXPECT_LT(a.distance(person(kRed, kBlue, 2)).value(), 0.1);
  EXPECT_LT(a.distance(person(kRed * 0.75, kBlue * 0.75, 3)).value(), 0.25);
  EXPECT_NEAR(a.distance(a).value(), 0, 1e-6);
}

TEST(Appearance, TellsColorsAndTheirOrderApart) {
  const Appearance a = person(kRed, kBlue);
  EXPECT_GT(a.distance(person(kGreen, kGray)).value(), 0.9);
  EXPECT_GT(a.distance(person(kBlue, kRed)).value(), 0.9);
  EXPECT_NEAR(a.distance(person(kRed, kGray)).value(), 0.5, 0.1);
}

TEST(Appearance, ComparesOnlyThePartsThatBothShow) {
  Appearance shirt_only;
  EXPECT_FALSE(shirt_only.distance(person(kRed, kBlue)).has_value());
  add_pixels(shirt_only, Appearance::Part::kUpper, kRed, 2);
  EXPECT_LT(shirt_only.distance(person(kRed, kBlue)).value(), 0.1);
  EXPECT_GT(shirt_only.distance(person(kBlue, kRed)).value(), 0.9);
}

TEST(Appearance, OfTwoTracksIsThatOfAllTheirPixels) {
  Appearance both = person(kRed, kBlue);
  const Appearance gray = person(kGray, kBlue);
  const double before = both.distance(gray).value();
  both.add(gray);
  EXPECT_LT(both.distance(gray).value(), before);
  EXPECT_LT(both.distance(person(kRed, kBlue)).value(), before);
}

}  // namespace
}  // namespace stillmap
