// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/board.hpp"

#include "stillmap/simulate/random.hpp"

#include <cmath>
#include <numbers>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kPrint = 512;                   // Side of the repeated print [pixels].
constexpr double kMetersPerPixel = 4e-3;      // Size of a pixel of the print [m].
constexpr double kSway = 0.05, kSways = 0.7;  // Amplitude [m] and frequency [Hz] of the sway.

/// Returns overlapping rectangles of all sizes: corners everywhere, no repetition.
cv::Mat printed_pattern(int seed) {
  simulate::Random random(static_cast<std::uint64_t>(seed), 77);
  cv::Mat pattern(kPrint, kPrint, CV_8UC3, cv::Scalar::all(128));
  for (int i = 0; i < 1500; ++i) {
    const cv::Rect area(random.integer(0, kPrint), random.integer(0, kPrint), random.integer(4, 40),
                        random.integer(4, 40));
    const cv::Scalar color(random.integer(20, 235), random.integer(20, 235),
                           random.integer(20, 235));
    cv::rectangle(pattern, area, color, cv::FILLED);
  }
  return pattern;
}

/// Returns the position on the print for each pixel.
cv::Mat2f looked_at(const Board& board, const Camera& camera, int width, double seconds) {
  const double x0 = -board.speed * seconds;
  const double y0 = kSway * std::sin(2 * std::numbers::pi * kSways * seconds);
  const auto on_print = [](double meters) {
    const double pixel = std::fmod(meters / kMetersPerPixel, kPrint - 1);
    return static_cast<float>(pixel < 0 ? pixel + kPrint - 1 : pixel);
  };
  cv::Mat2f where(camera.height, width);
  for (int v = 0; v < where.rows; ++v) {
    for (int u = 0; u < where.cols; ++u) {
      where(v, u) = {on_print(x0 + (u - camera.cx) / camera.fx * board.distance),
                     on_print(y0 + (v - camera.cy) / camera.fy * board.distance)};
    }
  }
  return where;
}

}  // namespace

RgbdFramePtr behind(const Board& board, const RgbdFrame& frame, const Camera& camera,
                    double seconds) {
  auto covered = std::make_shared<RgbdFrame>(frame);
  covered->color = frame.color.clone();
  covered->depth = frame.depth.clone();
  covered->gray = cv::Mat();  // Otherwise it would overwrite the input frame.
  const int width = static_cast<int>(std::lround(board.share * camera.width));
  if (width > 0) {
    const cv::Rect area(0, 0, width, camera.height);
    const cv::Mat pattern = board.printed ? printed_pattern(board.seed)
                                          : cv::Mat(kPrint, kPrint, CV_8UC3, cv::Scalar::all(60));
    cv::remap(pattern, covered->color(area), looked_at(board, camera, width, seconds), cv::Mat(),
              cv::INTER_LINEAR);
    covered->depth(area).setTo(board.distance);
  }
  cv::cvtColor(covered->color, covered->gray, cv::COLOR_BGR2GRAY);
  return covered;
}

}  // namespace stillmap
