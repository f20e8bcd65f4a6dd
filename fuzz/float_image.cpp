// SPDX-License-Identifier: Apache-2.0
// Depth images as NumPy arrays and OpenEXR files. OpenCV writes the OpenEXR files of the seeds.
#include "fuzz/image_target.hpp"
#include <opencv2/imgcodecs.hpp>

namespace {

cv::Mat depth() {
  cv::Mat image(6, 8, CV_32FC1);
  for (std::size_t i = 0; i < image.total(); ++i)
    image.ptr<float>()[i] = 0.1F * static_cast<float>(i);
  return image;
}

std::string exr_of(int compression) {
  std::vector<std::uint8_t> exr;
  cv::imencode(".exr", depth(), exr, {cv::IMWRITE_EXR_COMPRESSION, compression});
  return {exr.begin(), exr.end()};
}

std::string npy() {
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (6, 8), }";
  header.resize(117, ' ');
  const cv::Mat image = depth();
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + '\n' +
         std::string(reinterpret_cast<const char*>(image.data), image.total() * image.elemSize());
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> seeds{npy()};
  for (const int compression : {cv::IMWRITE_EXR_COMPRESSION_NO, cv::IMWRITE_EXR_COMPRESSION_RLE,
                                cv::IMWRITE_EXR_COMPRESSION_ZIPS, cv::IMWRITE_EXR_COMPRESSION_ZIP,
                                cv::IMWRITE_EXR_COMPRESSION_PIZ}) {
    try {
      seeds.push_back(exr_of(compression));
    } catch (const cv::Exception&) {  // OpenCV was built without OpenEXR.
      break;
    }
  }
  return seeds;
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  stillmap::fuzz::parse_depth_image({data, size});
  return 0;
}
