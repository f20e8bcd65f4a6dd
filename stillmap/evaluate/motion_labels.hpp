// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Motion label of one keypoint.
struct KeypointLabel {
  float u = 0, v = 0;         ///< Position in the image [pixels].
  float depth = 0;            ///< Depth along the optical axis [m]; 0 means unknown.
  float static_log_odds = 0;  ///< Log-odds that the keypoint lies on a static surface.
  float weight = 1;           ///< Weight of its residuals in the pose optimization [0..1].
  /// Returns whether the keypoint is labeled as moving, so that it does not count for the pose.
  bool moving() const { return weight <= 0; }
};

/// Motion labels of the keypoints of one frame.
struct LabeledFrame {
  std::size_t index = 0;  ///< Index of the frame in the sequence.
  double timestamp = 0;   ///< Time of the frame [s].
  std::vector<KeypointLabel> keypoints;
};

/// Motion labels of a sequence as a binary file with 10 bytes per keypoint, little endian, packed.
///
///     "stillmap labels 1\n"
///     per frame:     uint32 index, float64 timestamp [s], uint32 number of keypoints, and
///     per keypoint:  uint16 u, v [1/8 pixel], uint16 depth [mm; 0 unknown],
///                    int16 static log-odds [1/256], uint8 weight [1/255; 0 only where it is 0],
///                    uint8 0
///
/// In Python: numpy.dtype([("u", "<u2"), ("v", "<u2"), ("depth", "<u2"), ("log_odds", "<i2"),
/// ("weight", "u1"), ("zero", "u1")]). Values out of range are clipped.
class LabelFile {
 public:
  LabelFile();
  void add(const LabeledFrame& frame);
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Reads a file written by LabelFile. Throws Error for a file that cannot be read, is not a file of
/// labels, or ends within a frame.
std::vector<LabeledFrame> read_labels(const std::filesystem::path& file);

}  // namespace stillmap
