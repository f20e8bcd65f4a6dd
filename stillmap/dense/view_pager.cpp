// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_pager.hpp"

#include <array>
#include <string_view>

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
  if (view.depth.empty()) return false;
  const std::array parts{bytes_of(view.depth), bytes_of(view.color), bytes_of(view.kind),
                         bytes_of(view.photo)};
  if (!file_.write([&](PageFile& file) { view.pages = file.store(parts); })) return false;
  const cv::Size size = view.depth.size(), photo = view.photo.size();
  const std::byte* pixels = view.pages->data();
  view.depth = image_at<cv::Mat1w>(pixels, size);
  view.color = image_at<cv::Mat3b>(pixels, size);
  view.kind = image_at<cv::Mat1b>(pixels, size);
  if (!photo.empty()) view.photo = image_at<cv::Mat1b>(pixels, photo);
  return true;
}

}  // namespace stillmap
