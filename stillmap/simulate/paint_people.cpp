// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap::simulate::paint {
namespace {

void line(cv::Mat& image, cv::Point a, cv::Point b, const cv::Scalar& color, int thickness = 1) {
  cv::line(image, a, b, color, thickness, cv::LINE_AA);
}

/// Multiplies with the light and dark of woven cloth and its folds.
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

cv::Mat shirt(int kind, Random& random) {
  cv::Mat image(512, 512, CV_8UC3);
  const cv::Scalar base = vivid(random), other = vivid(random);
  switch (kind % 5) {
    case 0:
      plaid(image, base, other);
      buttons(image);
      break;
    case 1:
      image.setTo(cv::Scalar(222, 224, 224));
      for (int y = 0; y < 512; y += 42)
        cv::rectangle(image, {0, y, 512, 20}, shade(base, 0.8), cv::FILLED);
      break;
    case 2: {
      image.setTo(base);
      cv::circle(image, {256, 190}, 84, {225, 230, 232}, cv::FILLED, cv::LINE_AA);
      cv::circle(image, {256, 190}, 70, other, cv::FILLED, cv::LINE_AA);
      cv::putText(image, "SLAM", {200, 202}, cv::FONT_HERSHEY_DUPLEX, 1.3, {245, 245, 245}, 4,
                  cv::LINE_AA);
      for (const int x : {20, 400}) {
        cv::putText(image, "TEAM 07", {x, 150}, cv::FONT_HERSHEY_DUPLEX, 0.7, {240, 240, 240}, 2,
                    cv::LINE_AA);
        cv::rectangle(image, {x, 170, 90, 60}, other, cv::FILLED);
      }
      for (int y = 320; y < 512; y += 48) cv::rectangle(image, {0, y, 512, 12}, other, cv::FILLED);
      break;
    }
    case 3:
      image.setTo(shade(base, 0.7));
      cv::rectangle(image, {176, 330, 160, 110}, shade(base, 0.5), 6);
      cv::putText(image, "KINECT", {176, 180}, cv::FONT_HERSHEY_TRIPLEX, 1.3, {225, 230, 232}, 4,
                  cv::LINE_AA);
      line(image, {226, 0}, {232, 100}, {220, 220, 220}, 5);
      line(image, {286, 0}, {280, 100}, {220, 220, 220}, 5);
      for (int x = 0; x < 512; x += 36) line(image, {x, 470}, {x, 511}, shade(base, 1.2), 6);
      for (int i = 0; i < 40; ++i)
        cv::circle(image, {random.integer(0, 511), random.integer(0, 460)}, 6, shade(base, 1.3), 2,
                   cv::LINE_AA);
      break;
    default:
      image.setTo(shade(base, 0.9));
      for (int y = 0; y < 512; y += 32) {
        for (int x = 0; x < 512; x += 32) {
          cv::circle(image, {x + (y / 32 % 2) * 16, y + 8}, 9, {228, 230, 230}, cv::FILLED,
                     cv::LINE_AA);
        }
      }
      buttons(image);
  }
  weave(image, 0.22, random);
  return image;
}

cv::Mat sleeve(int kind, const cv::Mat& shirt) {
  // The lower back of the shirt has no print.
  const cv::Rect part =
      kind % 5 == 2 || kind % 5 == 3 ? cv::Rect(0, 240, 170, 260) : cv::Rect(0, 0, 200, 256);
  return shirt(part).clone();
}

cv::Mat trousers(int kind, Random& random) {
  const std::array bases{cv::Scalar(118, 78, 52), cv::Scalar(88, 120, 150), cv::Scalar(66, 62, 60)};
  const cv::Scalar base = bases[static_cast<std::size_t>(kind) % bases.size()];
  cv::Mat image(512, 256, CV_8UC3, base);
  for (const int x : {60, 188}) line(image, {x, 0}, {x, 511}, shade(base, 0.6), 3);
  for (int y = 0; y < 512; y += 7) {
    line(image, {64, y}, {64, y + 3}, {110, 170, 205}, 2);
    line(image, {192, y}, {192, y + 3}, {110, 170, 205}, 2);
  }
  for (int i = 0; i < 30; ++i) {  // worn places and creases
    const cv::Point a(random.integer(0, 255), random.integer(0, 511));
    line(image, a, a + cv::Point(random.integer(-40, 40), random.integer(-12, 12)),
         shade(base, random.uniform(0.6, 1.5)), random.integer(1, 4));
  }
  if (kind % 3 != 1) {
    cv::rectangle(image, {14, 180, 40, 60}, shade(base, 1.5), 3);
    cv::rectangle(image, {200, 260, 44, 60}, shade(base, 1.5), 3);
  }
  weave(image, 0.4, random);
  return image;
}

cv::Mat shoe(Random& random) {
  cv::Mat image = tint(noise({128, 64}, {8, 4}, 4, random), vivid(random), 0.2);
  cv::rectangle(image, {0, 48, 128, 16}, {230, 232, 232}, cv::FILLED);
  for (int x = 44; x < 84; x += 8) line(image, {x, 6}, {x + 6, 30}, {235, 235, 235}, 2);
  return image;
}

}  // namespace stillmap::simulate::paint
