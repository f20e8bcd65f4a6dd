// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"

#include <array>
#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Reduces images by bilinear interpolation: first between rows, then between columns, rounded
/// after each, with weights of 1/64. The outer edges of the images coincide: pixel i of the result
/// is at (i + 0.5) * from / to - 0.5. Reuses tables and memory for images of the same size.
class Shrinker {
 public:
  explicit Shrinker(CpuPath path = best_cpu_path()) : path_(path) {}

  /// @param from  8UC1, at least 2 x 2
  /// @param size  size of the result, not larger than `from`
  /// @param to    8UC1 result
  void operator()(const cv::Mat& from, cv::Size size, cv::Mat& to);

  /// Interpolation between source pixels `first` and first + 1; the second has weight / 64.
  struct Tap {
    int first = 0;
    int weight = 0;
  };
  /// Eight neighboring results from 16 neighboring source pixels.
  struct Block {
    int to = 0, from = 0;                  // first pixel of result and source
    std::array<std::uint8_t, 16> pick{};   // source pixels of each result's two taps
    std::array<std::int8_t, 16> weight{};  // weights of the taps
  };

 private:
  void prepare(cv::Size from, cv::Size to);

  CpuPath path_;
  cv::Size from_, to_;
  std::vector<Tap> columns_, rows_;
  std::vector<Block> blocks_;  // empty if the columns are too far apart
  std::vector<std::uint8_t> row_;
};

}  // namespace stillmap
