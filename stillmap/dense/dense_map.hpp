// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/keyframe_cloud.hpp"
#include "stillmap/dense/outlier_removal.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>

#include <opencv2/core.hpp>

namespace stillmap {

/// The static dense cloud: what is kept of each keyframe, and of all together.
struct DenseOptions {
  BackProjectionOptions back_projection;
  OutlierOptions outliers;
  double voxel = 0.01;    ///< side of the voxels of keyframe clouds and of the composed cloud [m]
  int min_samples = 1;    ///< voxels of the composed cloud with fewer pixels are dropped
  int min_keyframes = 1;  ///< voxels of the composed cloud seen by fewer keyframes are dropped
  int max_points =
      6000000;  ///< kept over all keyframes, ten bytes each; beyond, clouds are thinned
  STILLMAP_FIELDS(back_projection, outliers, voxel, min_samples, min_keyframes, max_points)
};

/// What a DenseMap holds and what it had to leave out, since it was made.
struct DenseStatistics {
  std::size_t keyframes = 0;  ///< held now
  std::size_t points = 0;     ///< held now, over all keyframes
  std::size_t outliers = 0;   ///< points dropped by the outlier removal so far
  std::size_t thinnings =
      0;  ///< how often a keyframe's cloud was made coarser to stay below max_points
};

/// A cloud, and what it was made of.
struct ComposedCloud {
  Cloud cloud;                         ///< world frame [m], ordered by voxel: x, then y, then z
  std::size_t keyframes = 0;           ///< that went in
  std::size_t keyframes_left_out = 0;  ///< whose pose was unknown or not finite
  std::size_t voxels_left_out = 0;     ///< below min_samples or min_keyframes
};

/// T_world_camera of a keyframe by its id; nothing where it is not known any more.
using PoseLookup = std::function<std::optional<Pose>(std::uint64_t)>;

/// The static dense map as in SLAM3-YOLOv8: per keyframe a cloud without moving pixels and
/// outliers, kept in the camera frame; composed with the final poses, and reduced by a voxel filter
/// over the whole.
///
/// Synchronous: one thread at a time, none inside. The result depends only on the set of keyframes
/// held (and, once max_points has been exceeded, on the order they came in).
class DenseMap {
 public:
  /// Throws Error if an option is out of range.
  explicit DenseMap(const Camera& camera, const DenseOptions& options = {});

  /// Takes the static points of a keyframe; an id that is held already is replaced.
  /// @param excluded moving pixels (not zero), height x width; empty for none
  /// Throws Error, with the map unchanged, if frame, mask and camera do not fit together.
  void add(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& excluded);

  /// Forgets a keyframe. One that is not held is no error. A culled keyframe need not be removed:
  /// its cloud stays useful as long as the caller can still tell its pose.
  void remove(std::uint64_t id);

  /// All clouds in the world frame. Keyframes without a pose are left out and counted.
  ComposedCloud compose(const PoseLookup& T_world_camera) const;

  DenseStatistics statistics() const;
  /// Memory held by the keyframe clouds.
  std::size_t bytes() const;

 private:
  void thin_to_bound();

  Camera camera_;
  DenseOptions options_;
  std::map<std::uint64_t, KeyframeCloud> clouds_;
  std::size_t points_ = 0, outliers_ = 0, thinnings_ = 0;
};

}  // namespace stillmap
