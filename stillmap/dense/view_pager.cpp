// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_pager.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"

#include <array>
#include <string>

namespace stillmap {
namespace {

std::string_view bytes_of(const cv::Mat& image) {
  return {reinterpret_cast<const char*>(image.data), image.total() * image.elemSize()};
}

/// Returns an image of these pixels, which are not copied, and moves on to those behind it.
template <typename Image>
Image image_at(const std::byte*& pixels, cv::Size size) {
  // Nothing writes to the images of a view once it is made; a cv::Mat cannot express that.
  auto* first = reinterpret_cast<typename Image::value_type*>(const_cast<std::byte*>(pixels));
  Image image(size.height, size.width, first);
  pixels += image.total() * image.elemSize();
  return image;
}

}  // namespace

bool ViewPager::page_out(DenseView& view) {
  if (view.pages) return true;
  if (failed_ || view.depth.empty()) return false;
  try {
    if (!file_) file_.emplace(memory_.folder);
    const std::array parts{bytes_of(view.depth), bytes_of(view.color), bytes_of(view.kind)};
    view.pages = file_->store(parts);
  } catch (const Error& e) {
    failed_ = true;
    warn(std::string("the dense map takes more memory than dense.memory from here on: ") + e.what(),
         "make room there; the map itself is not affected");
    return false;
  }
  const cv::Size size = view.depth.size();
  const std::byte* pixels = view.pages->data();
  view.depth = image_at<cv::Mat1w>(pixels, size);
  view.color = image_at<cv::Mat3b>(pixels, size);
  view.kind = image_at<cv::Mat1b>(pixels, size);
  return true;
}

}  // namespace stillmap
