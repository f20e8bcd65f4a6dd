// SPDX-License-Identifier: Apache-2.0
#include "fuzz/image_target.hpp"
#include <opencv2/imgcodecs.hpp>

namespace {

std::string jpeg_of(int type, const std::vector<int>& parameters) {
  cv::Mat image(16, 24, type);
  for (std::size_t i = 0; i < image.total() * image.elemSize(); ++i)
    image.data[i] = static_cast<std::uint8_t>(i * i / 8);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", image, jpeg, parameters);
  return {jpeg.begin(), jpeg.end()};
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  return {jpeg_of(CV_8UC3, {}), jpeg_of(CV_8UC1, {}),
          jpeg_of(CV_8UC3, {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_RST_INTERVAL, 1})};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  stillmap::fuzz::parse_image({data, size}, stillmap::decode_color_image);
  return 0;
}
