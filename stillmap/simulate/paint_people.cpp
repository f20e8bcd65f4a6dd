// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint_tools.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap::simulate::paint {
namespace {

/// Multiplies an image by the brightness pattern of woven cloth and its folds.
void weave(cv::Mat& image, double strength, Random& random) {
  const cv::Mat threads = noise(image.size(), {64, 64}, 3, random);
  const cv::Mat folds = noise(image.size(), {3, 6}, 4, random);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double f = 1 + strength * threads.at<float>(y, x) + 0.35 * folds.at<float>(y, x);
      auto& p = image.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) p[c] = cv::saturate_cast<std::uint8_t>(p[c] * f);
    }
  }
}

void plaid(cv::Mat& image, const cv::Scalar& base, const cv::Scalar& stripe) {
  image.setTo(base);
  cv::Mat bands = image.clone();
  for (int i = 0; i < image.cols; i += 64) {
    cv::rectangle(bands, {i, 0, 26, image.rows}, stripe, cv::FILLED);
    cv::rectangle(bands, {i + 40, 0, 5, image.rows}, {230, 230, 225}, cv::FILLED);
  }
  cv::Mat across = image.clone();
  for (int i = 0; i < image.rows; i += 64) {
    cv::rectangle(across, {0, i, image.cols, 26}, stripe, cv::FILLED);
    cv::rectangle(across, {0, i + 40, image.cols, 5}, {230, 230, 225}, cv::FILLED);
  }
  cv::addWeighted(bands, 0.5, across, 0.5, 0, image);
}

void buttons(cv::Mat& image) {
  line(image, {256, 0}, {256, image.rows}, {40, 40, 40}, 2);
  for (int y = 24; y < image.rows; y += 44)
    cv::circle(image, {256, y}, 5, {235, 235, 235}, cv::FILLED, cv::LINE_AA);
}

}  // namespace

cv::Mat skin(const cv::Scalar& color, Random& random) {
  return tint(noise({128, 128}, {4, 6}, 6, random), color, 0.16);
}

cv::Mat hair(const cv::Scalar& color, Random& random) {
  cv::Mat image = tint(noise({256, 128}, {64, 4}, 3, random), color, 0.7);
  for (int i = 0; i < 160; ++i) {
    const cv::Point a(random.integer(0, 255), random.integer(0, 100));
    line(image, a, a + cv::Point(random.integer(-6, 6), random.integer(14, 36)),
         shade(color, random.uniform(0.5, 2.0)));
  }
  return image;
}

cv::Mat face(const cv::Scalar& color, const cv::Scalar& hair_color, Random& random) {
  cv::Mat image = tint(noise({512, 256}, {8, 6}, 6, random), color, 0.1);
  const cv::Scalar dark = shade(color, 0.62), brow = shade(hair_color, 0.9);
  for (const int side : {-1, 1}) {
    const cv::Point eye(256 + side * 31, 118);
    cv::ellipse(image, {eye.x + side * 22, 152}, {22, 18}, 0, 0, 360, shade(color, 1.08),
                cv::FILLED, cv::LINE_AA);
    cv::ellipse(image, eye, {17, 9}, 0, 0, 360, {236, 238, 238}, cv::FILLED, cv::LINE_AA);
    cv::circle(image, eye, 7, {90, 70, 40}, cv::FILLED, cv::LINE_AA);
    cv::circle(image, eye, 4, {15, 15, 15}, cv::FILLED, cv::LINE_AA);
    cv::ellipse(image, eye, {18, 10}, 0, 190, 350, {30, 30, 40}, 3, cv::LINE_AA);
    cv::ellipse(image, {eye.x, eye.y - 8}, {22, 12}, 0, 200, 340, brow, 6, cv::LINE_AA);
  }
  line(image, {250, 124}, {246, 156}, dark, 2);
  cv::ellipse(image, {256, 158}, {13, 7}, 0, 0, 180, dark, 3, cv::LINE_AA);
  cv::ellipse(image, {256, 184}, {25, 8}, 0, 0, 360, {92, 92, 176}, cv::FILLED, cv::LINE_AA);
  line(image, {232, 184}, {280, 184}, {60, 54, 110}, 2);
  if (random.chance(0.4)) {  // glasses
    for (const int side : {-1, 1})
      cv::circle(image, {256 + side * 32, 119}, 24, {40, 36, 34}, 4, cv::LINE_AA);
    line(image, {248, 116}, {264, 116}, {40, 36, 34}, 4);
    line(image, {200, 114}, {120, 108}, {40, 36, 34}, 4);
    line(image, {312, 114}, {392, 108}, {40, 36, 34}, 4);
  }
  return image;
}

namespace {

void print_logo(cv::Mat& image, const cv::Scalar& color) {
  const cv::Scalar light(228, 232, 234);
  cv::circle(image, {256, 190}, 92, light, cv::FILLED, cv::LINE_AA);
  cv::circle(image, {256, 190}, 78, color, cv::FILLED, cv::LINE_AA);
  cv::putText(image, "SLAM", {192, 204}, cv::FONT_HERSHEY_DUPLEX, 1.5, light, 5, cv::LINE_AA);
  for (const int x : {-58, 454}) {  // on the back, over the seam
    cv::putText(image, "TEAM", {x, 150}, cv::FONT_HERSHEY_DUPLEX, 1.3, light, 4, cv::LINE_AA);
    cv::putText(image, "07", {x + 2, 260}, cv::FONT_HERSHEY_DUPLEX, 3, light, 10, cv::LINE_AA);
  }
  for (int y = 330; y < 512; y += 60) {
    cv::rectangle(image, {0, y, 512, 22}, light, cv::FILLED);
    cv::rectangle(image, {0, y + 26, 512, 8}, color, cv::FILLED);
  }
}

void knit_zigzag(cv::Mat& image, const cv::Scalar& color, const cv::Scalar& light) {
  for (int row = 0; row < 8; ++row) {
    for (int x = 0; x < 512; x += 64) {
      const int y = row * 64 + 12;
      const cv::Scalar& c = row % 2 == 0 ? light : color;
      line(image, {x, y}, {x + 32, y + 34}, c, 11);
      line(image, {x + 32, y + 34}, {x + 64, y}, c, 11);
      cv::circle(image, {x + 32, y + 4}, 7, row % 2 == 0 ? color : light, cv::FILLED, cv::LINE_AA);
    }
  }
}

}  // namespace

cv::Mat shirt(int kind, Random& random) {
  cv::Mat image(512, 512, CV_8UC3);
  const cv::Scalar light(224, 228, 230);
  switch (kind % 5) {
    case 0:
      plaid(image, {40, 44, 176}, {34, 30, 36});
      buttons(image);
      break;
    case 1:
      image.setTo(light);
      for (int y = 0; y < 512; y += 44)
        cv::rectangle(image, {0, y, 512, 22}, {112, 60, 30}, cv::FILLED);
      for (int x = 0; x < 512; x += 128) line(image, {x, 0}, {x, 511}, {60, 60, 180}, 6);
      break;
    case 2:
      image.setTo(cv::Scalar(132, 66, 34));
      print_logo(image, {40, 92, 214});
      break;
    case 3:
      image.setTo(cv::Scalar(70, 92, 40));
      knit_zigzag(image, {58, 150, 210}, light);
      break;
    default:
      image.setTo(cv::Scalar(52, 48, 58));
      for (int y = 0; y < 512; y += 40) {
        for (int x = 0; x < 512; x += 40) {
          const cv::Point at(x + (y / 40 % 2) * 20, y + 12);
          cv::circle(image, at, 11, random.chance(0.5) ? light : cv::Scalar(90, 170, 220),
                     cv::FILLED, cv::LINE_AA);
        }
      }
      buttons(image);
  }
  weave(image, 0.2, random);
  return image;
}

cv::Mat sleeve(int kind, const cv::Mat& shirt) {
  // The lower back of the shirt has no print.
  const cv::Rect part =
      kind % 5 == 2 || kind % 5 == 3 ? cv::Rect(0, 240, 170, 260) : cv::Rect(0, 0, 200, 256);
  return shirt(part).clone();
}

cv::Mat trousers(int kind, Random& random) {
  const std::array bases{cv::Scalar(124, 84, 58), cv::Scalar(96, 132, 164), cv::Scalar(74, 70, 68)};
  const cv::Scalar& base = bases[static_cast<std::size_t>(kind) % bases.size()];
  cv::Mat image(512, 256, CV_8UC3, base);
  for (int i = 0; i < 46; ++i) {  // worn places and creases
    const cv::Point a(random.integer(0, 255), random.integer(0, 511));
    line(image, a, a + cv::Point(random.integer(-50, 50), random.integer(-14, 14)),
         shade(base, random.chance(0.5) ? 0.55 : 1.5), random.integer(2, 6));
  }
  for (const int x : {64, 192}) {  // seams with their stitches
    line(image, {x, 0}, {x, 511}, shade(base, 0.5), 5);
    for (int y = 0; y < 512; y += 12) line(image, {x + 6, y}, {x + 6, y + 6}, {120, 190, 225}, 3);
  }
  cv::ellipse(image, {128, 440}, {46, 60}, 0, 0, 360, shade(base, 1.35), cv::FILLED, cv::LINE_AA);
  for (const int x : {8, 206}) {  // pockets
    cv::rectangle(image, {x, 190, 42, 66}, shade(base, 0.6), 5);
    cv::rectangle(image, {x, 190, 42, 18}, shade(base, 1.4), cv::FILLED);
    cv::circle(image, {x + 21, 200}, 5, {60, 120, 170}, cv::FILLED, cv::LINE_AA);
  }
  weave(image, 0.4, random);
  return image;
}

cv::Mat shoe(Random& random) {
  cv::Mat image = tint(noise({128, 64}, {8, 4}, 4, random), shade(muted(random), 0.8), 0.2);
  cv::rectangle(image, {0, 48, 128, 16}, {230, 232, 232}, cv::FILLED);
  for (int x = 44; x < 84; x += 8) line(image, {x, 6}, {x + 6, 30}, {235, 235, 235}, 2);
  return image;
}

}  // namespace stillmap::simulate::paint
