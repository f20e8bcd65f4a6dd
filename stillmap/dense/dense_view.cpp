// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/dense_view.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/segment/box_cluster.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/jpeg_image.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

void require_colors(const RgbdFrame& frame) {
  if (frame.color.type() == CV_8UC3 && frame.color.size() == frame.depth.size()) return;
  throw Error("the color image is not an 8-bit BGR image of the depth image's size",
              "dense keyframe " + std::to_string(frame.index),
              "register color and depth to one size before they enter the map");
}

PixelKind kind_of(float point_z, float far_z, bool moves) {
  if (moves) return kMoverSurface;
  if (point_z > 0) return kStaticSurface;
  return far_z > 0 ? kFarSurface : kNoSurface;
}

template <typename Image>
Image every_second(const Image& image) {
  Image half((image.rows + 1) / 2, (image.cols + 1) / 2);
  for (int row = 0; row < half.rows; ++row) {
    for (int col = 0; col < half.cols; ++col) half(row, col) = image(2 * row, 2 * col);
  }
  return half;
}

Camera on_lattice(Camera camera, cv::Size size, int stride) {
  camera.fx /= stride;
  camera.fy /= stride;
  camera.cx /= stride;
  camera.cy /= stride;
  camera.width = size.width;
  camera.height = size.height;
  return camera;
}

/// Returns depth and color of a frame on its lattice.
DenseView without_kinds(const Camera& camera, const RgbdFrame& frame, int stride) {
  const cv::Size size((frame.depth.cols + stride - 1) / stride,
                      (frame.depth.rows + stride - 1) / stride);
  DenseView view{.camera = on_lattice(camera, size, stride), .stride = stride};
  view.depth.create(size);
  view.color.create(size);
  view.kind.create(size);
  for (int row = 0; row < size.height; ++row) {
    for (int col = 0; col < size.width; ++col) {
      view.depth(row, col) = packed_depth(frame.depth.at<float>(row * stride, col * stride));
      view.color(row, col) = frame.color.at<cv::Vec3b>(row * stride, col * stride);
    }
  }
  return view;
}

// Marks static pixels near a mover's pixels with a depth in the range of theirs as doubtful, and
// far surfaces as no surface.
void mark_doubtful(DenseView& view) {
  constexpr double kReach = 24.0 / 640;  // of the image's width
  constexpr float kMargin = 0.2F;        // of the range of depths [m]
  const cv::Mat1b movers = view.kind == kMoverSurface;
  if (cv::countNonZero(movers) == 0) return;
  const int side = 2 * static_cast<int>(kReach * view.kind.cols) + 1;
  const cv::Mat window = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  cv::Mat1w farthest = view.depth.clone(), nearest = view.depth.clone();
  farthest.setTo(0, movers == 0);
  nearest.setTo(65535, (movers == 0) | (view.depth == 0));
  cv::dilate(farthest, farthest, window);
  cv::erode(nearest, nearest, window);
  const int margin = cvRound(kMargin / DenseView::kDepthUnit);
  for (int row = 0; row < view.kind.rows; ++row) {
    for (int col = 0; col < view.kind.cols; ++col) {
      const int z = view.depth(row, col);
      const bool near_mover = z > nearest(row, col) - margin && z < farthest(row, col) + margin;
      std::uint8_t& kind = view.kind(row, col);
      if (kind == kStaticSurface && near_mover) kind = kDoubtfulSurface;
      if (kind == kFarSurface && near_mover) kind = kNoSurface;
    }
  }
}

// Returns the indices of the instances by decreasing area, so that small ones are drawn last.
std::vector<std::size_t> by_decreasing_area(const std::vector<Instance>& instances) {
  std::vector<std::size_t> order(instances.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto area = [&](std::size_t i) {
    const Instance& instance = instances[i];
    return instance.mask.empty() ? instance.box.area() : cv::countNonZero(instance.mask);
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return area(a) > area(b); });
  return order;
}

void label(const Instance& instance, const cv::Mat1f& depth, DenseView& view) {
  if (view.instances.size() >= kFarSurface - kFirstInstance) return;
  const cv::Rect box = instance.box & cv::Rect({}, depth.size());
  if (box.empty()) return;
  const cv::Mat1b mask = instance.mask.empty() ? cluster_in_box(depth, box)
                                               : cv::Mat1b(instance.mask(box - instance.box.tl()));
  const auto value = static_cast<std::uint8_t>(kFirstInstance + view.instances.size());
  view.instances.push_back({instance.class_name, instance.confidence});
  for (int row = (box.y + view.stride - 1) / view.stride; row * view.stride < box.br().y; ++row) {
    for (int col = (box.x + view.stride - 1) / view.stride; col * view.stride < box.br().x; ++col) {
      const bool in_mask = mask(row * view.stride - box.y, col * view.stride - box.x) != 0;
      const bool unlabeled = view.is_static(row, col) && view.kind(row, col) != kDoubtfulSurface;
      if (in_mask && unlabeled) view.kind(row, col) = value;
    }
  }
}

}  // namespace

cv::Mat1b photo_of(const cv::Mat3b& image) {
  constexpr int kQuality = 90;
  return image.empty() ? cv::Mat1b() : cv::Mat1b(encode_jpeg(image, kQuality), true).reshape(0, 1);
}

cv::Mat3b image_of(const cv::Mat1b& photo) {
  return photo.empty() ? cv::Mat3b() : cv::Mat3b(decode_jpeg({photo.data, photo.total()}).image);
}

cv::Mat1b pixels_of_others(const DenseView& view, const cv::Mat3b& image) {
  constexpr int kLargest = 40;  // error of a channel of the JPEG file
  const auto fits = [&](int lattice, int size) {
    return (std::int64_t{lattice} - 1) * view.stride < size;
  };
  // A damaged file may contain an image of any size.
  if (!fits(view.color.rows, image.rows) || !fits(view.color.cols, image.cols))
    return {view.color.size(), 255};
  cv::Mat1b others = cv::Mat1b::zeros(view.color.size());
  for (int row = 0; row < others.rows; ++row) {
    for (int col = 0; col < others.cols; ++col) {
      const cv::Vec3b &own = image(row * view.stride, col * view.stride),
                      &pixel = view.color(row, col);
      for (int c = 0; c < 3; ++c)
        if (std::abs(int{own[c]} - int{pixel[c]}) > kLargest) others(row, col) = 255;
    }
  }
  return others;
}

Camera photo_camera(const DenseView& view) {
  Camera camera = view.camera;
  for (double* x : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *x *= view.stride;
  const cv::Size size = image_of(view.photo).size();
  camera.width = size.width;
  camera.height = size.height;
  return camera;
}

DenseView copy_of(const DenseView& view) {
  DenseView copy = view;
  copy.depth = view.depth.clone();
  copy.color = view.color.clone();
  copy.kind = view.kind.clone();
  copy.photo = view.photo.clone();
  copy.pages = nullptr;
  return copy;
}

std::uint16_t packed_depth(float meters) {
  const bool known = meters > 0 && std::isfinite(meters);
  return known ? cv::saturate_cast<std::uint16_t>(meters / DenseView::kDepthUnit) : 0;
}

MadeView make_dense_view(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& movers,
                         const BackProjectionOptions& back_projection,
                         const OutlierOptions& outliers, const FarOptions& far,
                         const SegmentedFrame* objects) {
  const TraceScope scope("view");
  PointGrid grid = back_project(camera, frame, movers, back_projection);
  require_colors(frame);
  MadeView made;
  made.outliers = remove_outliers(grid, outliers);
  const cv::Mat1f far_z =
      far_depths(camera.depth_sensor, frame.depth, movers, grid, back_projection, far);

  made.view = without_kinds(camera, frame, grid.stride);
  DenseView& view = made.view;
  for (int row = 0; row < view.kind.rows; ++row) {
    for (int col = 0; col < view.kind.cols; ++col) {
      const bool moves = !movers.empty() && movers(row * view.stride, col * view.stride) != 0;
      view.kind(row, col) = kind_of(grid.points(row, col)[2], far_z(row, col), moves);
      if (view.kind(row, col) == kFarSurface) view.depth(row, col) = packed_depth(far_z(row, col));
    }
  }
  mark_doubtful(view);
  if (objects == nullptr) return made;
  for (const std::size_t i : by_decreasing_area(objects->instances)) {
    label(objects->instances[i], frame.depth, view);
  }
  return made;
}

DenseView coarser(const DenseView& view) {
  DenseView half;
  half.stride = 2 * view.stride;
  half.depth = every_second(view.depth);
  half.color = every_second(view.color);
  half.kind = every_second(view.kind);
  half.instances = view.instances;
  half.visit = view.visit;
  half.camera = on_lattice(view.camera, half.depth.size(), 2);
  return half;
}

}  // namespace stillmap
