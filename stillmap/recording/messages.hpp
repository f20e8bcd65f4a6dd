// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/byte_cursor.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace stillmap {

/// Header of a message (std_msgs/Header).
struct MessageHeader {
  std::int64_t stamp = 0;  ///< [ns]
  std::string frame;       ///< Name of the coordinate frame, without a leading slash.
};

/// An image without compression (sensor_msgs/Image).
struct ImageMessage {
  MessageHeader header;
  std::uint32_t width = 0, height = 0;  ///< [pixels]
  std::string encoding;                 ///< Pixel format: "rgb8", "16UC1", ...
  bool big_endian = false;
  std::uint32_t step = 0;  ///< Distance of two rows [bytes].
  ByteSpan data;           ///< Rows; at least step * height bytes.
};

/// An image with compression (sensor_msgs/CompressedImage).
struct CompressedImageMessage {
  MessageHeader header;
  std::string format;  ///< "jpeg", "rgb8; jpeg compressed bgr8", "16UC1; compressedDepth png", ...
  ByteSpan data;
};

/// Intrinsics of a camera (sensor_msgs/CameraInfo).
struct CameraInfoMessage {
  MessageHeader header;
  std::uint32_t width = 0, height = 0;  ///< Size of the full, calibrated image [pixels].
  std::string distortion_model;         ///< "plumb_bob", "rational_polynomial", "equidistant", ...
  std::vector<double> distortion;       ///< D
  std::array<double, 9> intrinsics{};   ///< K of the recorded images, by rows [pixels].
  /// R, rotation of the camera to the rectified pair, by rows.
  std::array<double, 9> rectification{};
  std::array<double, 12> projection{};  ///< P of the rectified images, by rows [pixels].
  /// Number of pixels of the full image per recorded pixel; 0 means 1.
  std::uint32_t binning_x = 0, binning_y = 0;
  /// Part of the full image that is recorded [pixels of the full image]; all 0: the whole image.
  std::uint32_t roi_x = 0, roi_y = 0, roi_width = 0, roi_height = 0;
};

/// A sample of an inertial measurement unit (sensor_msgs/Imu).
struct ImuMessage {
  MessageHeader header;
  std::array<double, 3> angular_velocity{};     ///< [rad/s]
  std::array<double, 3> linear_acceleration{};  ///< With gravity [m/s^2].
};

/// Pose of a robot's base (nav_msgs/Odometry).
struct OdometryMessage {
  MessageHeader header;
  std::string child;  ///< Coordinate frame of the base, without a leading slash.
  Pose T_odom_base;
};

/// A transform between two coordinate frames (geometry_msgs/TransformStamped).
struct FrameTransform {
  std::string parent, child;  ///< Names without a leading slash.
  Pose T_parent_child;
};

/// Decoders of messages. The encoding is "ros1" or "cdr" (of either byte order). Spans in the
/// results point into `bytes`. Each throws Error if the bytes are damaged; counts and sizes are
/// checked before memory is taken.
ImageMessage decode_image(ByteSpan bytes, const std::string& encoding);
CompressedImageMessage decode_compressed_image(ByteSpan bytes, const std::string& encoding);
CameraInfoMessage decode_camera_info(ByteSpan bytes, const std::string& encoding);
ImuMessage decode_imu(ByteSpan bytes, const std::string& encoding);
OdometryMessage decode_odometry(ByteSpan bytes, const std::string& encoding);
std::vector<FrameTransform> decode_transforms(ByteSpan bytes, const std::string& encoding);
/// geometry_msgs/Transform.
Pose decode_transform(ByteSpan bytes, const std::string& encoding);
/// std_msgs/Float32.
float decode_float(ByteSpan bytes, const std::string& encoding);
/// std_msgs/String, or key=value of diagnostic_msgs/KeyValue.
std::string decode_text(ByteSpan bytes, const std::string& encoding);
std::string decode_key_value(ByteSpan bytes, const std::string& encoding);

}  // namespace stillmap
