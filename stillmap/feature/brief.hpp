// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/fast.hpp"
#include "stillmap/feature/features.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Minimum distance of corners from the image border, for orientation and descriptor [pixels].
inline constexpr int kPatchMargin = 16;

/// First moments of the intensity in a disc of radius 15 around a pixel, x right, y down: the
/// vector from the center to the intensity centroid, times the mass of the disc (Rosin 1999; Rublee
/// et al. 2011, eq. 1-3).
struct PatchMoments {
  int m10 = 0, m01 = 0;
  float angle() const;  ///< atan2(m01, m10) in (-pi, pi] [rad]; 0 for a flat patch.
  bool operator==(const PatchMoments&) const = default;
};

/// Computes the moments around each corner of an 8UC1 image. Corners must be at least kPatchMargin
/// from the border.
void patch_moments(const cv::Mat& image, std::span<const Corner> corners,
                   std::span<PatchMoments> moments, CpuPath path);

/// 7 x 7 Gaussian blur with sigma 2, reflected at the border; integer weights, rounded after each
/// direction. Reuses its memory.
class Blur {
 public:
  explicit Blur(CpuPath path = best_cpu_path()) : path_(path) {}
  /// Returns the blurred 8UC1 image (at least 4 x 4), valid until the next call.
  const cv::Mat& operator()(const cv::Mat& image);

 private:
  CpuPath path_;
  std::vector<std::uint8_t> buffer_, row_;
  cv::Mat blurred_;
};

/// 256 pairs of points within a disc of radius 15; bit i of a descriptor is 1 if the blurred image
/// is darker at `a` than at `b`.
struct BriefPattern {
  alignas(32) std::array<std::int16_t, 256> ax, ay, bx, by;
};
const BriefPattern& brief_pattern();

/// Computes steered BRIEF descriptors (Calonder et al., BRIEF, ECCV 2010; Rublee et al. 2011,
/// section 4): the pattern is rotated by the angle of the moments (sine and cosine to 1/1024,
/// points to the nearest pixel) and compared on the blurred image. Corners must be at least
/// kPatchMargin from the border.
void describe(const cv::Mat& blurred, std::span<const Corner> corners,
              std::span<const PatchMoments> moments, std::span<Descriptor> descriptors,
              CpuPath path, const BriefPattern& pattern = brief_pattern());

}  // namespace stillmap
