// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/texture_filter.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap::simulate {
namespace {

constexpr int kProbes = 4;  // Maximum number of texture samples of one pixel.
// Squared ratio of texel size to footprint: slightly sharper than the Nyquist limit, as cameras
// are.
constexpr float kSharpness = 0.6F;

/// Interpolates two color channels in one word, `f` of 256 parts from a to b.
std::uint32_t blend(std::uint32_t a, std::uint32_t b, std::uint32_t f) {
  constexpr std::uint32_t kBlueRed = 0xff00ff, kGreen = 0x00ff00;
  const std::uint32_t br = ((a & kBlueRed) * (256 - f) + (b & kBlueRed) * f) >> 8 & kBlueRed;
  const std::uint32_t g = ((a & kGreen) * (256 - f) + (b & kGreen) * f) >> 8 & kGreen;
  return br | g;
}

/// Returns the integer part of a number not far below zero, without a library call.
int floor_of(float value) {
  constexpr int kShift = 1 << 20;
  return static_cast<int>(value + static_cast<float>(kShift)) - kShift;
}

/// Returns the texture between four texels. (u, v) in periods, fractions of a texel in 256 parts.
std::uint32_t bilinear(const Texture::Level& level, float u, float v) {
  u -= static_cast<float>(floor_of(u));
  v -= static_cast<float>(floor_of(v));
  const int width = 1 << level.log2_width, height = 1 << level.log2_height;
  // A period is added, so that the number stays positive after subtracting half a texel.
  const int x = static_cast<int>((u + 1) * static_cast<float>(width * 256)) - 128;
  const int y = static_cast<int>((v + 1) * static_cast<float>(height * 256)) - 128;
  const int x0 = (x >> 8) & (width - 1), x1 = (x0 + 1) & (width - 1);
  const int y0 = (y >> 8) & (height - 1), y1 = (y0 + 1) & (height - 1);
  const std::uint32_t* row0 = level.texels.data() + (y0 << level.log2_width);
  const std::uint32_t* row1 = level.texels.data() + (y1 << level.log2_width);
  const auto fx = static_cast<std::uint32_t>(x & 255), fy = static_cast<std::uint32_t>(y & 255);
  return blend(blend(row0[x0], row0[x1], fx), blend(row1[x0], row1[x1], fx), fy);
}

/// A position between two mip levels.
struct MipLevel {
  const Texture::Level* fine;
  const Texture::Level* coarse;
  std::uint32_t fraction;  // of 256
};

/// Returns the level whose texels are as large as a footprint of squared size `texels2`.
MipLevel mip_level(const Texture& texture, float texels2) {
  const auto& levels = texture.levels();
  if (texels2 <= 1) return {levels.data(), levels.data(), 0};
  const float lod = std::min(0.5F * std::log2(texels2), static_cast<float>(levels.size()) - 1.001F);
  const auto index = static_cast<std::size_t>(lod);
  return {&levels[index], &levels[std::min(index + 1, levels.size() - 1)],
          static_cast<std::uint32_t>((lod - static_cast<float>(index)) * 256)};
}

std::uint32_t trilinear(const MipLevel& mip, float u, float v) {
  const std::uint32_t fine = bilinear(*mip.fine, u, v);
  return mip.fraction < 8 ? fine : blend(fine, bilinear(*mip.coarse, u, v), mip.fraction);
}

}  // namespace

Eigen::Vector3f filtered(const Texture& texture, const Footprint& f) {
  const float ratio2 = f.long2 / std::max(f.short2, 1e-12F);
  int probes = 1;
  while (probes < kProbes && ratio2 > 2.25F * static_cast<float>(probes * probes)) ++probes;
  const auto n = static_cast<float>(probes);
  const MipLevel mip = mip_level(texture, kSharpness * std::max(f.short2, f.long2 / (n * n)));
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i = 0; i < probes; ++i) {
    const float s = (static_cast<float>(i) + 0.5F) / n - 0.5F;
    const std::uint32_t texel = trilinear(mip, f.u + s * f.along.x(), f.v + s * f.along.y());
    sum += Eigen::Vector3f(static_cast<float>(texel & 255), static_cast<float>(texel >> 8 & 255),
                           static_cast<float>(texel >> 16 & 255));
  }
  return sum / n;
}

}  // namespace stillmap::simulate
