// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/stereo_rig.hpp"

#include <memory>

#include <opencv2/calib3d.hpp>

namespace stillmap {

/// Share of the pixels of a stereo pair that match [0..1].
struct MatchShares {
  double given = 0;      ///< In the given order.
  double exchanged = 0;  ///< With left and right exchanged.

  /// Whether the images match much better in the given order, or exchanged.
  bool tell_given() const;
  bool tell_exchanged() const;
};

/// Depth of a rectified pair of images by semi-global matching (Hirschmueller, "Stereo processing
/// by semiglobal matching and mutual information", PAMI 2008, in OpenCV's variant) with subpixel
/// interpolation. A pixel whose match in the right image leads back to another pixel, as at
/// occlusions, has no depth, and neither have ambiguous and isolated matches. One thread at a time.
class StereoMatcher {
 public:
  /// @param camera  left camera of a rig: its baseline, and the range of its depth sensor
  explicit StereoMatcher(const Camera& camera);

  /// Returns the depth of the left image, 32FC1 [m]; 0: unknown. The left border, as wide as the
  /// largest disparity, has none.
  /// @param left, right  rectified, 8UC1, of the camera's size
  cv::Mat depth(const cv::Mat& left, const cv::Mat& right);

  /// Returns the shares of pixels for which depth() finds a match, in both orders of the images.
  MatchShares match_shares(const cv::Mat& left, const cv::Mat& right);

  /// Throws Error if the first pair matches much better with its images exchanged. Does nothing
  /// for later pairs.
  void check_order(const cv::Mat& left, const cv::Mat& right);

 private:
  Camera camera_;
  bool order_is_checked_ = false;
  cv::Ptr<cv::StereoSGBM> matcher_;
};

/// Returns the depth of the left images of a rig, 32FC1 [m]; 0: unknown. Throws Error as
/// StereoMatcher::check_order().
/// @param left   rectified, 8UC3
/// @param right  as recorded, 8UC3
cv::Mat depth_of_pair(const StereoRig& rig, StereoMatcher& matcher, const cv::Mat& left,
                      const cv::Mat& right);

}  // namespace stillmap
