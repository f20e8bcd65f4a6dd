// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/messages.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <concepts>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Reads the fields of a message. ROS 1: little-endian, without padding. CDR (OMG, Extensible and
/// Dynamic Topic Types, 7.4): numbers are aligned to their size, relative to the end of the
/// encapsulation header of four bytes, which tells the byte order; texts end with a zero byte.
class MessageReader {
 public:
  MessageReader(ByteSpan bytes, const std::string& encoding)
      : cursor_(bytes), cdr_(encoding == "cdr") {
    if (!cdr_) return;
    const ByteSpan encapsulation = cursor_.take(4);
    const unsigned kind = encapsulation[0] << 8 | encapsulation[1];
    // 0 and 1: CDR; 6 to 9: CDR of version 2. Odd numbers are little-endian.
    if (kind > 1 && (kind < 6 || kind > 9))
      throw Error(fmt::format("the encapsulation {} of CDR is not known", kind), "", "");
    big_endian_ = kind % 2 == 0;
    largest_alignment_ = kind > 1 ? 4 : 8;
  }

  template <typename T>
  T get() {
    align(sizeof(T));
    ByteSpan bytes = cursor_.take(sizeof(T));
    std::array<std::uint8_t, sizeof(T)> ordered;
    std::copy(bytes.begin(), bytes.end(), ordered.begin());
    if (big_endian_) std::reverse(ordered.begin(), ordered.end());
    return std::bit_cast<T>(ordered);
  }
  /// Returns a number of elements after checking that they can follow.
  std::uint32_t count(std::size_t bytes_per_element) {
    const auto count = get<std::uint32_t>();
    if (count > cursor_.left() / bytes_per_element) {
      throw Error(fmt::format("{} elements are declared, but only {} bytes are left", count,
                              cursor_.left()),
                  "", "");
    }
    return count;
  }
  std::string text() {
    std::string_view text = ByteCursor::as_text(cursor_.take(count(1)));
    if (cdr_ && text.ends_with('\0')) text.remove_suffix(1);
    return std::string(text);
  }
  ByteSpan bytes() { return cursor_.take(count(1)); }
  template <std::size_t N>
  std::array<double, N> doubles() {
    std::array<double, N> values;
    for (double& value : values) value = get<double>();
    return values;
  }
  MessageHeader header() {
    if (!cdr_) get<std::uint32_t>();  // sequence number
    const auto seconds = get<std::uint32_t>(), nanoseconds = get<std::uint32_t>();
    return {seconds * std::int64_t{1'000'000'000} + nanoseconds, frame()};
  }
  std::string frame() {
    std::string name = text();
    if (name.starts_with('/')) name.erase(0, 1);
    return name;
  }
  Pose transform() {
    const auto t = doubles<3>();
    const auto q = doubles<4>();  // x, y, z, w
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    const Eigen::Vector3d translation(t[0], t[1], t[2]);
    if (!translation.allFinite() || !(std::abs(rotation.norm() - 1) < 0.01))
      throw Error("a transform is no rigid motion", "", "");
    return {rotation, translation};
  }

 private:
  void align(std::size_t size) {
    if (!cdr_) return;
    const std::size_t alignment = std::min(size, largest_alignment_);
    const std::size_t at = cursor_.position() - 4;
    cursor_.take((alignment - at % alignment) % alignment);
  }

  ByteCursor cursor_;
  bool cdr_, big_endian_ = false;
  std::size_t largest_alignment_ = 8;
};

}  // namespace

ImageMessage decode_image(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  ImageMessage image;
  image.header = in.header();
  image.height = in.get<std::uint32_t>();
  image.width = in.get<std::uint32_t>();
  image.encoding = in.text();
  image.big_endian = in.get<std::uint8_t>() != 0;
  image.step = in.get<std::uint32_t>();
  image.data = in.bytes();
  const std::uint64_t needed = std::uint64_t{image.step} * image.height;
  if (needed > image.data.size()) {
    throw Error(fmt::format("has {} bytes of pixels, and {} rows of {} bytes need {}",
                            image.data.size(), image.height, image.step, needed),
                "", "");
  }
  return image;
}

CompressedImageMessage decode_compressed_image(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  CompressedImageMessage image;
  image.header = in.header();
  image.format = in.text();
  image.data = in.bytes();
  return image;
}

CameraInfoMessage decode_camera_info(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  CameraInfoMessage info;
  info.header = in.header();
  info.height = in.get<std::uint32_t>();
  info.width = in.get<std::uint32_t>();
  info.distortion_model = in.text();
  const auto coefficients = in.count(sizeof(double));
  for (std::uint32_t i = 0; i < coefficients; ++i) info.distortion.push_back(in.get<double>());
  info.intrinsics = in.doubles<9>();
  info.rectification = in.doubles<9>();
  info.projection = in.doubles<12>();
  info.binning_x = in.get<std::uint32_t>();
  info.binning_y = in.get<std::uint32_t>();
  info.roi_x = in.get<std::uint32_t>();
  info.roi_y = in.get<std::uint32_t>();
  info.roi_height = in.get<std::uint32_t>();
  info.roi_width = in.get<std::uint32_t>();
  return info;
}

ImuMessage decode_imu(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  ImuMessage imu;
  imu.header = in.header();
  in.doubles<4>();  // orientation
  in.doubles<9>();  // and the covariances
  imu.angular_velocity = in.doubles<3>();
  in.doubles<9>();
  imu.linear_acceleration = in.doubles<3>();
  return imu;
}

OdometryMessage decode_odometry(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  OdometryMessage odometry;
  odometry.header = in.header();
  odometry.child = in.frame();
  odometry.T_odom_base = in.transform();
  return odometry;
}

std::vector<FrameTransform> decode_transforms(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  constexpr std::size_t kSmallest = 7 * sizeof(double);  // of one transform [bytes]
  std::vector<FrameTransform> transforms;
  const auto count = in.count(kSmallest);
  for (std::uint32_t i = 0; i < count; ++i) {
    FrameTransform transform;
    transform.parent = in.header().frame;
    transform.child = in.frame();
    transform.T_parent_child = in.transform();
    transforms.push_back(std::move(transform));
  }
  return transforms;
}

Pose decode_transform(ByteSpan bytes, const std::string& encoding) {
  return MessageReader(bytes, encoding).transform();
}

float decode_float(ByteSpan bytes, const std::string& encoding) {
  return MessageReader(bytes, encoding).get<float>();
}

std::string decode_text(ByteSpan bytes, const std::string& encoding) {
  return MessageReader(bytes, encoding).text();
}

std::string decode_key_value(ByteSpan bytes, const std::string& encoding) {
  MessageReader in(bytes, encoding);
  const std::string key = in.text();
  return key + "=" + in.text();
}

}  // namespace stillmap
