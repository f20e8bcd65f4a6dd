// SPDX-License-Identifier: Apache-2.0
// TIFF files of depth: read by libtiff.
#include "fuzz/image_target.hpp"
#include <opencv2/imgcodecs.hpp>

namespace {

std::string tiff_of(int type, const std::vector<int>& parameters) {
  cv::Mat image(6, 8, type);
  for (std::size_t i = 0; i < image.total() * image.elemSize(); ++i)
    image.data[i] = static_cast<std::uint8_t>(i * i);
  std::vector<std::uint8_t> tiff;
  cv::imencode(".tiff", image, tiff, parameters);
  return {tiff.begin(), tiff.end()};
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  constexpr int kNoCompression = 1, kDeflate = 8;  // numbers of TIFF
  return {tiff_of(CV_16UC1, {}), tiff_of(CV_32FC1, {}),
          tiff_of(CV_16UC1, {cv::IMWRITE_TIFF_COMPRESSION, kNoCompression}),
          tiff_of(CV_32FC1, {cv::IMWRITE_TIFF_COMPRESSION, kDeflate})};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  stillmap::fuzz::parse_depth_image({data, size});
  return 0;
}
