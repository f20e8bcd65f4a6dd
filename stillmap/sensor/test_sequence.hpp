// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/sequence.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {

/// For tests: a small valid sequence in a temporary folder, to be damaged. Removed with the object.
class TestSequence {
 public:
  /// `frames` frames at 30 Hz from time 100 s; depth 5 ms later. Color: a gray ramp; depth: 2 m.
  explicit TestSequence(int frames = 3) {
    static std::atomic<int> counter = 0;
    folder_ = test::own_path(fmt::format("sequence_{}", counter++));
    std::filesystem::create_directories(folder_ / "rgb");
    std::filesystem::create_directories(folder_ / "depth");
    std::string color_list = "# color images\n", depth_list = "# depth maps\n";
    for (int i = 0; i < frames; ++i) {
      write_image(color_name(i), color_image());
      write_image(depth_name(i), depth_image());
      color_list += fmt::format("{:.6f} {}\n", stamp(i), color_name(i));
      depth_list += fmt::format("{:.6f} {}\n", stamp(i) + 0.005, depth_name(i));
    }
    write("rgb.txt", color_list);
    write("depth.txt", depth_list);
  }
  TestSequence(const TestSequence&) = delete;
  TestSequence& operator=(const TestSequence&) = delete;
  ~TestSequence() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  static double stamp(int i) { return 100 + i / 30.0; }
  static std::string color_name(int i) { return fmt::format("rgb/{}.png", i); }
  static std::string depth_name(int i) { return fmt::format("depth/{}.png", i); }

  /// 64 x 48, f = 60, no distortion.
  static Camera camera() {
    Camera camera;
    camera.name = "small";
    camera.width = 64;
    camera.height = 48;
    camera.fx = camera.fy = 60;
    camera.cx = 31.5;
    camera.cy = 23.5;
    return camera;
  }
  static cv::Mat color_image(cv::Size size = {64, 48}, int type = CV_8UC3) {
    cv::Mat image(size, type);
    for (int x = 0; x < size.width; ++x) image.col(x).setTo(cv::Scalar::all(40 + 2 * (x % 100)));
    return image;
  }
  static cv::Mat depth_image(double meters = 2, cv::Size size = {64, 48}) {
    return cv::Mat(size, CV_16UC1, cv::Scalar(meters * 5000));
  }

  void write(const std::string& name, std::string_view content) const {
    std::ofstream(path(name), std::ios::binary) << content;
  }
  void write_image(const std::string& name, const cv::Mat& image) const {
    cv::imwrite(path(name).string(), image);
  }
  /// Truncates a file to `share` of its bytes.
  void truncate(const std::string& name, double share) const {
    const auto bytes = static_cast<double>(std::filesystem::file_size(path(name)));
    std::filesystem::resize_file(path(name), static_cast<std::uintmax_t>(bytes * share));
  }

  TumFolder open(const FrameRange& range = {}) const {
    return TumFolder(find_sequence(folder_), camera(), range);
  }

 private:
  std::filesystem::path folder_;
};

/// Returns all frames of a source.
inline std::vector<RgbdFramePtr> all_frames(FrameSource& source) {
  std::vector<RgbdFramePtr> frames;
  while (RgbdFramePtr frame = source.next()) frames.push_back(frame);
  return frames;
}

}  // namespace stillmap
