// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/stamped_images.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

constexpr double kTolerance = 0.01;  // between a frame's stamp and its image's name [s]

cv::Mat read_gray(const fs::path& file) {
  const auto [image, problem] = read_stored_image(file);
  if (!problem.empty()) throw Error(problem, file.string(), "write it again, as an 8-bit PNG");
  if (image.type() == CV_8UC1) return image;
  if (image.depth() != CV_8U || image.channels() != 3)
    throw Error("is no gray image of 8 bits", file.string(), "write it again, as an 8-bit PNG");
  cv::Mat gray;
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

}  // namespace

StampedImages::StampedImages(const fs::path& folder) {
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    if (entry.path().extension() != ".png") continue;
    const std::string name = entry.path().stem().string();
    if (const auto stamp = number_of(name)) files_.emplace_back(*stamp, entry);
  }
  std::sort(files_.begin(), files_.end());
  if (files_.empty()) {
    throw Error("holds no mask (a PNG named by its frame's stamp in seconds)", folder.string(),
                "name the folder with the true masks of the sequence");
  }
}

cv::Mat StampedImages::at(double timestamp) const {
  const auto nearest =
      std::min_element(files_.begin(), files_.end(), [&](const auto& a, const auto& b) {
        return std::abs(a.first - timestamp) < std::abs(b.first - timestamp);
      });
  if (std::abs(nearest->first - timestamp) > kTolerance) return {};
  return read_gray(nearest->second);
}

}  // namespace stillmap
