// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/page_file.hpp"
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/far_surface.hpp"
#include "stillmap/dense/outlier_removal.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Label of a pixel of a DenseView.
enum PixelKind : std::uint8_t {
  kNoSurface = 0,      ///< No usable surface: no depth, too far, at a depth jump or an outlier.
  kStaticSurface = 1,  ///< A static surface without an instance.
  kFirstInstance = 2,  ///< First of the instances: kFirstInstance + i is DenseView::instances[i].
  /// A static surface of uncertain depth, see FarOptions, used only where no nearer view exists.
  kFarSurface = 253,
  /// A static surface without an instance, close to a mover and at a similar depth, which may be a
  /// part of the mover outside its mask.
  kDoubtfulSurface = 254,
  kMoverSurface = 255,  ///< A surface of an object that moves or may move.
};

/// An object that a network detected in a keyframe.
struct ViewInstance {
  std::string class_name;
  float confidence = 0;  ///< [0..1]
  bool operator==(const ViewInstance&) const = default;
};

/// The dense data of a keyframe in its own camera frame, which stay valid when the pose changes:
/// six bytes for every pixel of a coarser lattice, and the whole image as a JPEG file.
struct DenseView {
  Camera camera = {};    ///< Of the lattice: pixel (c, r) is pixel (c, r) * stride of the image.
  int stride = 1;        ///< [pixels of the image]
  cv::Mat1w depth = {};  ///< All measured depths, in units of kDepthUnit; 0 if unknown.
  cv::Mat3b color = {};  ///< B G R.
  cv::Mat1b kind = {};   ///< PixelKind.
  /// The image of its own frame in full size as the bytes of a JPEG file; empty in maps of former
  /// programs. `color` differs from it where another frame showed a surface behind a mover.
  cv::Mat1b photo = {};
  std::vector<ViewInstance> instances = {};  ///< By PixelKind.
  /// Number of the visit that made it, ascending with time: what a later visit shows has appeared
  /// since.
  std::uint16_t visit = kPresentVisit;
  /// Owner of the pixels of the four images, which are read-only then; null if the images own
  /// them.
  std::shared_ptr<const Pages> pages = {};

  static constexpr std::uint16_t kPresentVisit = 65535;  ///< The run itself.
  /// Unit of the depths [m]: far below the noise, for depths up to 13 m.
  static constexpr float kDepthUnit = 0.0002F;

  /// Returns whether a pixel shows a static surface of certain depth.
  bool is_static(int row, int col) const {
    const std::uint8_t k = kind(row, col);
    return k != kNoSurface && k != kFarSurface && k != kMoverSurface;
  }
  /// Returns the index of the instance of a static pixel, or -1 for none.
  int instance_at(int row, int col) const {
    const bool known = is_static(row, col) && kind(row, col) < kFarSurface;
    return known ? int{kind(row, col)} - kFirstInstance : -1;
  }
  std::size_t bytes() const { return sizeof(*this) + 6 * depth.total() + photo.total(); }
  /// Returns the memory that the pixels take as long as the view exists [bytes].
  std::size_t bytes_in_memory() const { return pages ? 0 : 6 * depth.total() + photo.total(); }
  /// Gives back the memory of pages that were used, until they are used again.
  void drop_pages() const {
    if (pages) pages->drop();
  }
};

/// A keyframe's view, and the number of points dropped as outliers.
struct MadeView {
  DenseView view;
  std::size_t outliers = 0;
};

/// Returns the view of a keyframe. A pixel shows a static surface if back_project() gives a point
/// that remove_outliers() keeps, and a far surface if far_depths() gives a depth, which it then
/// has.
/// @param movers pixels of objects that move or may move (not zero), height x width; empty for none
/// @param objects instances in this frame's pixels, which label its static pixels, the smaller of
///   two on one pixel; null for none
/// Throws Error if the sizes of frame, mask and camera differ or an option is out of range.
MadeView make_dense_view(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& movers,
                         const BackProjectionOptions& back_projection = {},
                         const OutlierOptions& outliers = {}, const FarOptions& far = {},
                         const SegmentedFrame* objects = nullptr);

/// Returns an image (8UC3 BGR) as DenseView::photo, and the image of a photo; empty for an empty
/// one.
cv::Mat1b photo_of(const cv::Mat3b& image);
cv::Mat3b image_of(const cv::Mat1b& photo);

/// Returns the pixels of a view that are not those of the image of its photo: 255.
cv::Mat1b pixels_of_others(const DenseView& view, const cv::Mat3b& image);

/// Returns the camera of the photo of a view.
Camera photo_camera(const DenseView& view);

/// Returns a copy that owns its pixels.
DenseView copy_of(const DenseView& view);

/// Returns the R G B of a pixel.
inline Eigen::Vector3f rgb_of(const cv::Vec3b& bgr) {
  return {static_cast<float>(bgr[2]), static_cast<float>(bgr[1]), static_cast<float>(bgr[0])};
}

/// Returns a depth [m] in units of DenseView::kDepthUnit; 0 if it is unknown.
std::uint16_t packed_depth(float meters);

/// Returns the view on every second pixel, without a photo.
DenseView coarser(const DenseView& view);

}  // namespace stillmap
