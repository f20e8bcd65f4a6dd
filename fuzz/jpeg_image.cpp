// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/image_file.hpp"

#include "fuzz/fuzz_target.hpp"
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
  using namespace stillmap;
  constexpr std::int64_t kLargestArea = 1 << 16;  // Larger images would only take time [pixels].
  const std::span<const unsigned char> jpeg(data, size);
  const auto [header, problem] = decode_image_header(jpeg);
  if (!problem.empty() || std::int64_t{header.size.width} * header.size.height > kLargestArea)
    return 0;
  const ImageRead read = decode_color_image(jpeg, header.size);
  if (read.problem.empty() != !read.image.empty()) std::abort();
  if (!read.image.empty() && read.image.size() != header.size) std::abort();
  fuzz::accepted += read.problem.empty() ? 1 : 0;
  return 0;
}
