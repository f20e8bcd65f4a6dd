// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint_tools.hpp"

#include <fmt/format.h>

namespace stillmap::simulate::paint {
namespace {

constexpr int kSide = 1024;  // pixels

/// Adds oil stains, cracks and tire marks.
void wear(cv::Mat& image, Random& random) {
  const auto anywhere = [&] {
    return cv::Point(random.integer(0, image.cols - 1), random.integer(0, image.rows - 1));
  };
  for (int i = 0; i < 26; ++i) {
    const cv::Scalar stain = shade(cv::Scalar(118, 122, 124), random.uniform(0.45, 1.3));
    cv::ellipse(image, anywhere(), {random.integer(3, 26), random.integer(3, 16)},
                random.uniform(0, 180), 0, 360, stain, cv::FILLED, cv::LINE_AA);
  }
  for (int i = 0; i < 14; ++i) {
    cv::Point at = anywhere();
    for (int step = 0; step < 9; ++step) {
      const cv::Point next = at + cv::Point(random.integer(-40, 40), random.integer(-40, 40));
      line(image, at, next, {70, 72, 74}, random.integer(1, 2));
      at = next;
    }
  }
  for (int i = 0; i < 6; ++i) line(image, anywhere(), anywhere(), {84, 86, 88}, 9);
}

}  // namespace

cv::Mat concrete(Random& random) {
  cv::Mat image = tint(noise({kSide, kSide}, {24, 24}, 5, random), {146, 150, 152}, 0.22);
  wear(image, random);
  for (const int at : {0, kSide / 2}) {
    line(image, {at, 0}, {at, kSide}, {92, 94, 96}, 5);
    line(image, {0, at}, {kSide, at}, {92, 94, 96}, 5);
  }
  return image;
}

cv::Mat floor_sign(int number, Random& random) {
  cv::Mat image = tint(noise({512, 512}, {16, 16}, 4, random), {60, 190, 226}, 0.18);
  frame(image, {40, 40, 40}, 24);
  write(image, fmt::format("{:02}", number), {70, 330}, 8, {36, 36, 36}, 26,
        cv::FONT_HERSHEY_DUPLEX);
  write(image, title(random), {60, 440}, 2, {36, 36, 36}, 6);
  return image;
}

cv::Mat container_side(const cv::Scalar& color, Random& random) {
  cv::Mat image = tint(noise({kSide, kSide / 2}, {20, 10}, 4, random), color, 0.12);
  for (int x = 0; x < image.cols; x += 32) {
    fill(image, {x, 0, 12, image.rows}, shade(color, 0.78));
    line(image, {x + 13, 0}, {x + 13, image.rows}, shade(color, 1.25), 2);
  }
  for (int i = 0; i < 40; ++i) {
    const cv::Point at(random.integer(0, image.cols - 1), random.integer(0, image.rows - 1));
    line(image, at, at + cv::Point(random.integer(-4, 4), random.integer(8, 60)), {40, 62, 96}, 3);
  }
  fill(image, {90, 90, 420, 130}, {224, 226, 228});
  write(image, title(random), {104, 180}, 2.6, {40, 40, 46}, 8, cv::FONT_HERSHEY_DUPLEX);
  write(image, fmt::format("{} {:06}", title(random).substr(0, 4), random.integer(1, 999999)),
        {560, 150}, 1.6, {230, 230, 230}, 4);
  text_block(image, {640, 200, 320, 220}, 0.9, {226, 226, 226}, random);
  frame(image, shade(color, 0.6), 18);
  return image;
}

cv::Mat container_roof(const cv::Scalar& color, Random& random) {
  cv::Mat image = tint(noise({512, 512}, {14, 14}, 4, random), shade(color, 0.9), 0.2);
  for (int y = 0; y < image.rows; y += 32) {
    fill(image, {0, y, image.cols, 10}, shade(color, 0.7));
  }
  for (int i = 0; i < 60; ++i) {
    disc(image, {random.integer(0, 511), random.integer(0, 511)}, random.integer(2, 14),
         random.chance(0.5) ? cv::Scalar(52, 84, 128) : shade(color, 1.3));
  }
  write(image, fmt::format("{}{}", title(random).substr(0, 2), random.integer(10, 99)), {70, 320},
        6, {232, 232, 232}, 16, cv::FONT_HERSHEY_DUPLEX);
  frame(image, shade(color, 0.5), 22);
  return image;
}

}  // namespace stillmap::simulate::paint
