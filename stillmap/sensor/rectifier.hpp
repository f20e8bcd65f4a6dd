// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/recording/camera_model.hpp"
#include "stillmap/sensor/stereo_rig.hpp"

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Rectifies images of a distorted camera to those of an ideal pinhole camera with the same size,
/// focal lengths and principal point (radial-tangential model: Brown 1966; as OpenCV's
/// initUndistortRectifyMap). Images of a camera without distortion are returned without a copy.
///
/// All constructors throw Error if the file `ignore` of the camera is no image of its size, or if
/// all or none of its pixels are black.
class Rectifier {
 public:
  explicit Rectifier(const Camera& recorded);
  /// @param lens  distortion of the recorded images; that of `recorded` is not used
  Rectifier(const Camera& recorded, const LensDistortion& lens);
  /// For the left images that rectified() of a rig returns. The file `ignore` of its camera is for
  /// the images as recorded.
  explicit Rectifier(const StereoRig& rig);

  /// Returns the ideal pinhole camera: the recorded camera without distortion, disparity bias and
  /// `ignore`.
  const Camera& camera() const { return camera_; }
  /// Returns the ignored pixels of the rectified images: see RgbdFrame::ignored.
  const cv::Mat& ignored() const { return ignored_; }
  /// Returns a note with the share of ignored pixels and their file; empty if there are none.
  const std::string& ignored_note() const { return ignored_note_; }
  /// Returns the finding that more than half of the pixels are ignored; empty otherwise.
  const std::vector<Finding>& findings() const { return findings_; }
  bool active() const { return !nearest_map_.empty(); }

  /// Rectifies color or gray images with bilinear interpolation. Pixels outside the recorded image
  /// repeat its border, so that no edge appears there.
  cv::Mat image(const cv::Mat& recorded) const;
  /// Rectifies depth, masks and labels of any type by nearest neighbor, so that no values are
  /// invented; 0 outside the recorded image.
  cv::Mat nearest(const cv::Mat& recorded) const;

 private:
  void check(const cv::Mat& recorded) const;
  void ignore(const std::string& file, const cv::Mat& pixels);

  Camera camera_;
  cv::Mat whole_map_,
      fraction_map_;     // bilinear: 16SC2 pixel and index into OpenCV's table of weights
  cv::Mat nearest_map_;  // 16SC2, rounded
  cv::Mat ignored_;
  std::string ignored_note_;
  std::vector<Finding> findings_;
};

}  // namespace stillmap
