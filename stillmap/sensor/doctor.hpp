// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Thresholds for warnings, chosen on indoor recordings of a Kinect.
struct DoctorOptions {
  int sample = 40;                ///< Number of decoded frames, spread evenly over the sequence.
  std::size_t most_frames = 300;  ///< Number of first frames that FrameCheck examines.
  double least_share = 0.25;      ///< Minimum share of pixels with depth [0..1].
  double dark = 20;     ///< Mean gray value below which an image is too dark for tracking [0..255].
  double bright = 235;  ///< Mean gray value above which an image is overexposed [0..255].
  double blurred = 15;  ///< Variance of the Laplacian of the gray image below which it is blurred.
  double max_speed = 3;  ///< Camera speed of the ground truth above which there is a jump [m/s].
};

/// Measurements and findings. Values are 0 where nothing could be measured.
struct Diagnosis {
  std::vector<Finding> findings;  ///< In the order of the checks.
  std::size_t frames = 0;         ///< Number of pairs of color and depth.
  /// Number of pairs with both files present and of the right type.
  std::size_t usable_frames = 0;
  double duration = 0;       ///< Time from the first to the last pair [s].
  double frame_rate = 0;     ///< Frame rate from the median interval [Hz].
  double median_depth = 0;   ///< Median depth of the sampled frames [m].
  double depth_share = 0;    ///< Share of pixels with depth in the sampled frames [0..1].
  double median_offset = 0;  ///< Median of depth timestamp minus color timestamp [s].

  /// Returns the severity of the worst finding.
  Severity conclusion() const { return worst(findings); }
  /// Adds a finding, unless there is one with the same message.
  void add(Finding finding);
  /// Adds that something was examined and is right.
  void add_ok(std::string message);
};

/// Checks a sequence and its camera: lists and pairs, every file's existence, type, size and end, a
/// sample of decoded images, timestamps, depth scale, ground truth; and, with FrameCheck, its first
/// frames. Problems are returned as findings, never thrown.
/// @param camera       the user's camera; without it the sequence's camera.yaml is used
/// @param associations file that pairs color and depth images; empty: see find_sequence()
Diagnosis diagnose(const std::filesystem::path& folder, const std::optional<Camera>& camera = {},
                   const std::filesystem::path& associations = {},
                   const DoctorOptions& options = {});

/// Returns the finding that the depths of a folder cannot have the unit of the camera: the median
/// reading of some images is outside the range of the camera's sensor or nearer than 0.3 m, or the
/// 5th or 99th percentile is far outside. None if they can, and if no image can be read. Takes
/// some tens of milliseconds.
std::optional<Finding> depth_unit_finding(const std::filesystem::path& folder, const Camera& camera,
                                          const std::filesystem::path& associations = {});

/// Returns the finding that the frames of a folder are not in the order of the numbers in the names
/// of their color images, such as those of a list that was sorted as text; none if they are.
std::optional<Finding> order_finding(const std::filesystem::path& folder,
                                     const std::filesystem::path& associations = {});

/// Returns the finding that the ground truth of a sequence cannot be read, for this reason.
Finding unreadable_truth(const Error& reason);

/// Checks a source that is no folder of images, such as a recorded file or a stereo pair, by its
/// first frames, with FrameCheck.
Diagnosis diagnose(FrameSource& source, std::size_t most_frames);

}  // namespace stillmap
