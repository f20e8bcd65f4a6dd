// SPDX-License-Identifier: Apache-2.0
// Messages of recordings. The first byte of an input selects encoding and decoder, the rest is the
// message.
#include "stillmap/recording/messages.hpp"

#include "stillmap/sensor/recorded_image.hpp"

#include "fuzz/recording_target.hpp"

namespace {

using namespace stillmap;

// Flags of the first byte: encoding ros1, otherwise cdr; images of an odd width.
constexpr std::uint8_t kRos1 = 0x80, kOddWidth = 0x40;

void try_camera(const CameraInfoMessage& info, cv::Size size) {
  if (const auto camera = camera_of(info, false)) sized(*camera, info, size.width, size.height);
}

void decode(std::uint8_t first, ByteSpan message, const std::string& encoding) {
  const cv::Size size((first & kOddWidth) != 0 ? 5 : 4, 3);
  const int decoder = first & ~(kRos1 | kOddWidth);
  switch (decoder % 11) {
    case 0:
      decode_recorded_color({.storage = ImageStorage::kPixels}, encoding, message, size);
      decode_recorded_depth({.storage = ImageStorage::kPixels}, encoding, message, size);
      decode_image(message, encoding);
      break;
    case 1:
      decode_recorded_depth({.storage = ImageStorage::kCompressedDepth}, encoding, message, size);
      decode_compressed_image(message, encoding);
      break;
    case 2:
      try_camera(decode_camera_info(message, encoding), size);
      break;
    case 3:
      camera_of(decode_camera_info(message, encoding), true);
      break;
    case 4:
      decode_transforms(message, encoding);
      break;
    case 5:
      decode_transform(message, encoding);
      break;
    case 6:
      decode_float(message, encoding);
      break;
    case 7:
      decode_text(message, encoding);
      break;
    case 8:
      decode_key_value(message, encoding);
      break;
    case 9:
      decode_recorded_color({.storage = ImageStorage::kFile}, encoding, message, size);
      decode_compressed_image(message, encoding);
      break;
    default:
      decode_recorded_depth({.storage = ImageStorage::kFile}, encoding, message, size);
      decode_compressed_image(message, encoding);
  }
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> inputs;
  for (const auto kind : {test::Kind::kRos1, test::Kind::kLittleCdr, test::Kind::kBigCdr}) {
    const auto add = [&](std::uint8_t decoder, const std::string& message) {
      const std::uint8_t flag = kind == test::Kind::kRos1 ? kRos1 : 0;
      inputs.push_back(static_cast<char>(flag + decoder) + message);
    };
    const auto messages = recorded_messages(kind);
    add(0, messages[0].data);
    add(1, messages[1].data);
    add(2, messages[2].data);
    add(3, messages[3].data);
    add(4, messages[4].data);
    test::MessageWriter pose(kind);
    for (const double value : {1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0}) pose.put(value);
    add(5, pose.bytes());
    add(6, test::MessageWriter(kind).put(0.5F).bytes());
    add(7, test::MessageWriter(kind).text("text").bytes());
    add(8, test::MessageWriter(kind).text("key").text("value").bytes());
    const test::TestCamera camera{.kind = kind};
    add(0, camera.image(1, 0, 4, 3, "32FC1", 4, std::string(48, 'd')));
    add(0, camera.image(1, 0, 4, 3, "bayer_rggb8", 1, std::string(12, 'd')));
    add(kOddWidth, camera.image(1, 0, 5, 3, "yuv422", 2, std::string(30, 'd')));
    // RVL: no zeros, then 12 pixels, the first with depth 5, the others with difference 0.
    const std::string rvl("\4\0\0\0\3\0\0\0\0\x10\x1a\x0c\0\0\0\0", 16);
    add(1,
        camera.compressed_image(1, 0, "16UC1; compressedDepth rvl", std::string(12, '\0') + rvl));
    add(9, messages[1].data);
    add(10, messages[1].data);
  }
  return inputs;
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string encoding = (data[0] & kRos1) != 0 ? "ros1" : "cdr";
  fuzz::parse([&] { decode(data[0], ByteSpan(data + 1, size - 1), encoding); });
  return 0;
}
