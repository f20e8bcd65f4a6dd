// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/far_surface.hpp"
#include "stillmap/dense/outlier_removal.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// What a pixel of a DenseView shows.
enum PixelKind : std::uint8_t {
  kNoSurface = 0,      ///< nothing that could be placed: no depth, too far, at a jump, an outlier
  kStaticSurface = 1,  ///< a static surface of no known thing
  kFirstInstance = 2,  ///< from here on: part of a static thing, see DenseView::instances
  /// A static surface too far away to be sure where it is, see FarOptions. It counts only where
  /// nobody came nearer.
  kFarSurface = 253,
  /// A static surface of no known thing, close to a mover's and about as far away: perhaps a part
  /// of the mover that its mask left out.
  kDoubtfulSurface = 254,
  kMoverSurface = 255,  ///< part of something that moves, whether it does at the moment or not
};

/// A thing that a network found in a keyframe.
struct ViewInstance {
  std::string class_name;
  float confidence = 0;  ///< 0 to 1
  bool operator==(const ViewInstance&) const = default;
};

/// What the dense map keeps of a keyframe, in the keyframe's own camera frame, so that it can be
/// placed anew whenever the pose changes: six bytes for every pixel of a coarser lattice.
struct DenseView {
  Camera camera = {};    ///< of the lattice: pixel (c, r) is pixel (c, r) * stride of the image
  int stride = 1;        ///< pixels of the image
  cv::Mat1w depth = {};  ///< all that was measured, movers too, in units of kDepthUnit; 0 unknown
  cv::Mat3b color = {};  ///< B G R
  cv::Mat1b kind = {};   ///< PixelKind
  std::vector<ViewInstance> instances = {};  ///< kind kFirstInstance + i is number i

  /// 0.2 mm: far below the noise, and 13 m can be told [m].
  static constexpr float kDepthUnit = 0.0002F;

  /// Whether a pixel shows a static surface that is sure to be where it is measured.
  bool is_static(int row, int col) const {
    const std::uint8_t k = kind(row, col);
    return k != kNoSurface && k != kFarSurface && k != kMoverSurface;
  }
  /// Number of the instance that a static pixel is part of; -1 for none.
  int instance_at(int row, int col) const {
    const bool known = is_static(row, col) && kind(row, col) < kFarSurface;
    return known ? int{kind(row, col)} - kFirstInstance : -1;
  }
  std::size_t bytes() const { return sizeof(*this) + 6 * depth.total(); }
};

/// A keyframe's view, and how many points its outlier removal dropped.
struct MadeView {
  DenseView view;
  std::size_t outliers = 0;
};

/// Makes the view of a keyframe. A pixel shows a static surface where back_project() gives a point
/// and remove_outliers() leaves it,
/// and a far one, at the depth that it gives, where far_depths() does.
/// @param movers pixels of things that move or may (not zero), height x width; empty for none
/// @param things  instances in this frame's pixels; those of static things label its pixels, of two
/// on one pixel the smaller. Null for none
/// Throws Error if the sizes of frame, mask and camera differ or an option is out of range.
MadeView make_dense_view(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& movers,
                         const BackProjectionOptions& back_projection = {},
                         const OutlierOptions& outliers = {}, const FarOptions& far = {},
                         const SegmentedFrame* things = nullptr);

/// The pixels of a thing of which only a box is known, as a mask of the box's size: those whose
/// depth belongs to the cluster that the middle of the box shows most of, depths within a cluster
/// being less than 10 cm apart (YOLO11n's boxes hold a good deal of what is behind).
cv::Mat1b cluster_in_box(const cv::Mat1f& depth, const cv::Rect& box);

/// The same view on every second pixel.
DenseView coarser(const DenseView& view);

}  // namespace stillmap
