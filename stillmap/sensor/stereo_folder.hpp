// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_range.hpp"
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/stereo_matcher.hpp"
#include "stillmap/sensor/stereo_rig.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// One pair of images; the file of the right one is empty if it is missing.
struct StereoFiles {
  double timestamp = 0;  ///< [s]
  std::filesystem::path left, right;
};

/// A folder with the images of two cameras side by side, and their calibration.
struct StereoSequence {
  StereoRig rig;
  std::vector<StereoFiles> frames;
  std::vector<SkippedFrame> skipped;
  std::string layout;  ///< For the user: "KITTI, image_2 and image_3".
};

/// Returns whether a folder has one of the layouts that read_stereo_folder() reads.
bool is_stereo_folder(const std::filesystem::path& folder);

/// Reads a folder in one of two layouts:
/// - KITTI odometry: rectified images in image_2 and image_3 (preferred, color), image_0 and
///   image_1, or image_l and image_r; calib.txt with lines "P0:" to "P3:" of 12 numbers, or two
///   lines of 12 numbers, left and right; times.txt with one time [s] a line. Without times.txt the
///   frames have a rate of `fps` [Hz].
/// - EuRoC: mav0/cam0 and mav0/cam1, each with data.csv (timestamp [ns], file), data/ and
///   sensor.yaml (intrinsics, distortion, T_BS); the images are rectified.
/// Throws Error with file and fix for a missing file, a damaged calibration, and if there are no
/// images.
StereoSequence read_stereo_folder(const std::filesystem::path& folder, double fps);

/// The frames of a stereo sequence: the left images, with depth by StereoMatcher.
class StereoFolder : public FrameSource {
 public:
  /// Throws Error for a range out of range.
  StereoFolder(StereoSequence sequence, const FrameRange& range);

  const Camera& camera() const override { return rectifier_.camera(); }
  RgbdFramePtr next() override;
  void skip_before(double timestamp) override;
  std::optional<std::size_t> size() const override { return sequence_.frames.size() - position_; }
  const std::vector<SkippedFrame>& skipped() const override { return sequence_.skipped; }
  std::vector<std::string> notes() const override;
  std::vector<Finding> findings() const override { return rectifier_.findings(); }

 private:
  RgbdFramePtr load(const StereoFiles& files);
  cv::Mat load_depth(const StereoFiles& files, const cv::Mat& left);

  StereoSequence sequence_;
  Rectifier rectifier_;  // for images that the rig has rectified
  StereoMatcher matcher_;
  std::size_t position_ = 0;    // index of the next frame in sequence_.frames
  std::size_t next_index_ = 0;  // index of the next returned frame
};

}  // namespace stillmap
