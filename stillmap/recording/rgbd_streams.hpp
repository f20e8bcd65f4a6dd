// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/camera_model.hpp"
#include "stillmap/recording/recording.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// How the images of a topic are stored.
enum class ImageStorage {
  kPixels,          ///< sensor_msgs/Image.
  kFile,            ///< sensor_msgs/CompressedImage: a JPEG or PNG file.
  kCompressedDepth  ///< sensor_msgs/CompressedImage: parameters, then a PNG file or RVL code.
};

/// Size of the parameters before an image of ImageStorage::kCompressedDepth [bytes].
inline constexpr std::size_t kCompressedDepthParameters = 12;

/// The images of one topic.
struct ImageStream {
  std::uint32_t topic = 0;
  std::string name = {};  ///< Of the topic.
  ImageStorage storage = ImageStorage::kPixels;
  std::string encoding = {};              ///< Pixel format: "rgb8", "16UC1", "32FC1", ...
  std::string frame = {};                 ///< Coordinate frame of the camera.
  int width = 0, height = 0;              ///< Image size [pixels]; 0 if only the images tell it.
  std::vector<MessageEntry> images = {};  ///< With the stamps of the images.
  std::optional<RecordedCamera> camera = {};  ///< None if the recording does not contain it.
  /// Topic of the camera_info; empty without one. If it is not calibrated, `camera` is none.
  std::string camera_topic = {};
  /// How `camera` differs from the camera_info, as a sentence for the user; empty if it does not.
  std::string camera_note = {};

  bool is_depth() const;
};

/// The color and depth images of a recording, or the images of a stereo pair.
struct RgbdStreams {
  ImageStream color;  ///< Of a stereo pair, the left images.
  ImageStream depth;  ///< Of a stereo pair, the right images.
  /// Pose of the right camera in the frame of the left one; none if the images are not a stereo
  /// pair.
  std::optional<Pose> T_left_right;
  bool pose_by_projections = false;  ///< Whether T_left_right is from P and R.
  /// Pose of the depth camera in the frame of the color camera; none if the depth images are
  /// registered to the color images.
  std::optional<Pose> T_color_depth;
  double depth_factor = 1000;     ///< Units per meter of 16-bit depth [1/m].
  bool unit_is_recorded = false;  ///< Whether the recording contains the unit.
  double fps = 30;                ///< Rate of the color images [Hz].
  std::string sensor;             ///< Name for find_depth_sensor(); empty if it is not known.
  /// One sentence for each choice and each assumption.
  std::vector<std::string> notes;
  std::vector<Finding> findings;  ///< What looks wrong.
};

/// Returns all image topics with at least one readable image.
std::vector<ImageStream> image_streams(Recording& recording);

/// Returns the error that the recorded camera of a stream has K = 0, as an uncalibrated one.
Error not_calibrated(const Recording& recording, const ImageStream& stream);

/// Finds the color and depth images by type, content, encoding and name, and what the recording
/// contains about their cameras. Both are of one camera, according to the words in their topics and
/// frames and to the transform between them. Of several cameras the one with the most images is
/// taken, and the notes name the others.
/// @param topics  names of two topics, "COLOR,DEPTH" or, of a stereo pair, "LEFT,RIGHT"; empty to
///                choose color and depth
/// Throws Error, with the image topics of the recording, if there is no such pair, if the depth
/// images are not registered and no transform to the color camera is recorded, and if the
/// calibration of a stereo pair is not recorded.
RgbdStreams find_rgbd_streams(Recording& recording, const std::string& topics = "");

}  // namespace stillmap
