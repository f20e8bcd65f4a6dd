// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/exr_image.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace stillmap {
namespace {

using View = std::span<const unsigned char>;

constexpr std::array<unsigned char, 4> kMagic{0x76, 0x2f, 0x31, 0x01};

/// A file in memory.
class MemoryStream : public Imf::IStream {
 public:
  explicit MemoryStream(View bytes) : IStream("image"), bytes_(bytes) {}

  bool read(char* to, int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (at_ > bytes_.size() || size > bytes_.size() - at_)
      throw std::runtime_error("its end is missing");
    std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override { at_ = position; }

 private:
  View bytes_;
  std::size_t at_ = 0;
};

/// Returns the depth channel; null if there is none in the full size of the image.
const Imf::Channel* depth_channel(const Imf::ChannelList& channels, std::string& name) {
  const auto is_only = [&] { return ++channels.begin() == channels.end(); };
  const Imf::Channel* found = nullptr;
  if (channels.begin() != channels.end() && is_only()) {
    name = channels.begin().name();
    found = &channels.begin().channel();
  }
  for (const char* usual : {"Z", "Y", "R"}) {
    if (found != nullptr) break;
    name = usual;
    found = channels.findChannel(usual);
  }
  return found != nullptr && found->xSampling == 1 && found->ySampling == 1 ? found : nullptr;
}

cv::Size size_of(const Imath::Box2i& window) {
  return {window.max.x - window.min.x + 1, window.max.y - window.min.y + 1};
}

}  // namespace

bool is_exr(View bytes) {
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

HeaderRead exr_header(View bytes) {
  try {
    MemoryStream stream(bytes);
    const Imf::InputFile file(stream, 1);
    std::string name;
    const Imf::Channel* depth = depth_channel(file.header().channels(), name);
    if (depth == nullptr) return {{}, "has no channel Z, Y or R of the size of the image"};
    if (!file.isComplete()) return {{}, "is truncated or damaged: its end is missing"};
    ImageHeader header{size_of(file.header().dataWindow()), 32, 1};
    header.samples = depth->type == Imf::UINT ? Samples::kOther : Samples::kFloat;
    return {header, ""};
  } catch (const std::exception& error) {
    return {{}, fmt::format("is truncated or damaged: {}", error.what())};
  }
}

cv::Mat decode_exr(View bytes) {
  try {
    MemoryStream stream(bytes);
    Imf::InputFile file(stream, 1);
    std::string name;
    if (depth_channel(file.header().channels(), name) == nullptr) return {};
    const Imath::Box2i& window = file.header().dataWindow();
    cv::Mat image(size_of(window), CV_32FC1, cv::Scalar(0));
    Imf::FrameBuffer pixels;
    pixels.insert(name,
                  Imf::Slice::Make(Imf::FLOAT, image.data, window, sizeof(float), image.step));
    file.setFrameBuffer(pixels);
    file.readPixels(window.min.y, window.max.y);
    return image;
  } catch (const std::exception&) {  // reported as damage, like an empty image
    return {};
  }
}

}  // namespace stillmap
