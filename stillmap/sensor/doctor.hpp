// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

enum class Severity { kOk, kWarning, kError };

/// One thing looked at, in plain words.
struct Finding {
  Severity severity = Severity::kOk;
  std::string what;  ///< what was found
  std::string fix;   ///< what to do about it; empty if nothing
};

/// Thresholds of suspicion; measured on Kinect recordings indoors, where the sensor sees 0.4 m to
/// 10 m.
struct DoctorOptions {
  int sample = 40;            ///< frames decoded, spread evenly over the sequence
  double near_median = 0.3;   ///< a smaller median depth of the sample is suspicious [m]
  double far_median = 8;      ///< a larger one too [m]
  double nearest = 0.25;      ///< so is a 5th percentile below this [m]
  double farthest = 12;       ///< or a 99th percentile above this [m]
  double least_share = 0.25;  ///< share of an image's pixels that should have depth
  double dark = 20;           ///< mean gray below which an image is too dark to track on [0-255]
  double bright = 235;        ///< mean gray above which it is burnt out [0-255]
  double blurred = 15;        ///< variance of the gray image's Laplacian below which it is blurred
  double max_speed = 3;       ///< of the camera, by the ground truth; faster is a jump [m/s]
  STILLMAP_FIELDS(sample, near_median, far_median, nearest, farthest, least_share, dark, bright,
                  blurred, max_speed)
};

/// What was measured and found. The figures are 0 where nothing could be measured.
struct Diagnosis {
  std::vector<Finding> findings;  ///< in the order of the checks
  std::size_t frames = 0;         ///< pairs of color and depth
  std::size_t usable_frames = 0;  ///< of these, with both files there and of the right kind
  double duration = 0;            ///< seconds from first to last pair
  double frame_rate = 0;          ///< Hz, from the median interval
  double median_depth = 0;        ///< meters, over the sampled frames' known pixels
  double depth_share = 0;         ///< share of pixels with depth in the sampled frames, 0 to 1
  double median_offset = 0;       ///< seconds, depth stamp minus color stamp

  /// The worst of the findings.
  Severity conclusion() const;
  void add(Severity severity, std::string what, std::string fix = "");
};

/// Examines a sequence and its camera: lists and pairs, every file's existence, type, size and end,
/// a sample of decoded images, stamps, depth scale, ground truth. What is wrong comes back as
/// findings; nothing is thrown for it.
/// @param camera what the user named; without it the sequence's own camera.yaml is used
Diagnosis diagnose(const std::filesystem::path& folder, const std::optional<Camera>& camera = {},
                   const DoctorOptions& options = {});

}  // namespace stillmap
