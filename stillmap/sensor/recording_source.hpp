// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/rgbd_streams.hpp"
#include "stillmap/sensor/depth_registration.hpp"
#include "stillmap/sensor/frame_range.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/inertial_source.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/stereo_matcher.hpp"
#include "stillmap/sensor/stereo_rig.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A ROS 1 bag, or a recording of rosbag2 (SQLite or MCAP), as a source of frames. Color and depth
/// images are paired by their stamps, as those of a TUM folder. Depth images that are not
/// registered to the color camera are registered. For a stereo pair, depth is computed by
/// StereoMatcher, and the color images are the left ones.
class RecordingSource : public FrameSource {
 public:
  /// @param camera  replaces the recorded color camera and the unit of 16-bit depth; none to use
  ///                those of the recording. A stereo pair needs its own cameras.
  /// @param topics  "COLOR,DEPTH", "LEFT,RIGHT", or empty: see find_rgbd_streams()
  /// @param ignore  replaces Camera::ignore of the camera; empty: not replaced
  /// Throws Error if the file is no recording, has no color and depth images or no camera, and if
  /// no frame can be used.
  RecordingSource(const std::filesystem::path& path, const std::optional<Camera>& camera,
                  const std::string& topics, const FrameRange& range = {},
                  const std::string& ignore = {});

  const Camera& camera() const override { return rectifier_->camera(); }
  /// Returns the camera of the recorded color images. Distortion that Camera cannot describe is not
  /// part of it.
  const Camera& recorded_camera() const { return recorded_; }
  RgbdFramePtr next() override;
  void skip_before(double timestamp) override;
  std::optional<std::size_t> size() const override { return frames_.size() - position_; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }
  std::vector<std::string> notes() const override;
  std::vector<Finding> findings() const override;
  /// Returns the samples of an IMU and of wheels that the recording contains and whose pose is
  /// known. Then camera().imu and camera().wheels are set.
  const MotionSamples& motion_samples() const { return motion_samples_; }

 private:
  struct Image {
    double timestamp = 0;  // seconds
    MessageEntry message;
  };
  struct Frame {
    double timestamp = 0, depth_timestamp = 0;  // seconds
    MessageEntry color;
    std::optional<MessageEntry> depth;
  };

  void choose_cameras(const std::optional<Camera>& camera, const std::string& ignore);
  void choose_pair(const std::optional<Camera>& camera, const std::string& ignore);
  void turn_baseline_if_images_tell();
  void find_imu_samples();
  void find_odometry();
  void keep_longest_stretch();
  void pair_images();
  std::vector<Image> increasing_images(const ImageStream& stream);
  void require_one_usable_frame();
  void require_depth_in_view();
  void use_unit_of_d405();
  std::optional<Finding> far_depth() const;
  double median_raw_depth();
  bool uses_unit() const;
  bool contradicts_unit() const;
  RgbdFramePtr load(const Frame& frame);
  cv::Mat load_depth(const Frame& recorded, const cv::Mat& color);
  ImageRead color_image(const MessageEntry& message);
  ImageRead depth_image(const MessageEntry& message);
  using Decoder = ImageRead (*)(const ImageStream&, const std::string&, ByteSpan, cv::Size);
  ImageRead decoded(const ImageStream& stream, const MessageEntry& message, Decoder decode,
                    cv::Size size);
  cv::Mat registered(const cv::Mat& raw) const;

  Recording recording_;
  RgbdStreams streams_;
  Camera recorded_;
  MotionSamples motion_samples_;
  std::string imu_note_, odometry_note_;
  std::optional<Rectifier> rectifier_;
  std::optional<DepthRegistration> registration_;
  std::optional<StereoRig> rig_;          // of a stereo pair
  std::optional<StereoMatcher> matcher_;  // of a stereo pair
  bool given_ = false;                    // whether the camera is not that of the recording
  double median_raw_depth_ = 0;           // of some images; 0 for floats and without readings
  std::vector<Frame> frames_;
  std::vector<SkippedFrame> skipped_;
  std::size_t position_ = 0;    // index of the next frame in frames_
  std::size_t next_index_ = 0;  // index of the next returned frame
};

/// Returns the camera of the recorded color images, or of the rectified left images of a stereo
/// pair. Throws Error if the recording does not contain it.
Camera color_camera(const Recording& recording, const RgbdStreams& streams);

}  // namespace stillmap
