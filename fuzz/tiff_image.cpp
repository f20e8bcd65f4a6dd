// SPDX-License-Identifier: Apache-2.0
// TIFF files of depth: their header is read here, their pixels by OpenCV.
#include "stillmap/sensor/image_file.hpp"

#include "fuzz/fuzz_target.hpp"
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
  using namespace stillmap;
  constexpr std::int64_t kLargestArea = 1 << 16;  // Larger images would only take time [pixels].
  const std::span<const unsigned char> tiff(data, size);
  const auto [header, problem] = decode_image_header(tiff);
  if (!problem.empty() || std::int64_t{header.size.width} * header.size.height > kLargestArea)
    return 0;
  const ImageRead read = decode_depth_image(tiff, header.size);
  if (read.problem.empty() != !read.image.empty()) std::abort();
  if (!read.image.empty() && (read.image.size() != header.size || read.image.channels() != 1))
    std::abort();
  fuzz::accepted += read.problem.empty() ? 1 : 0;
  return 0;
}
