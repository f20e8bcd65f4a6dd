// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// What a system thought of one keypoint.
struct KeypointLabel {
  float u = 0, v = 0;                          ///< pixels
  float depth = 0;                             ///< meters along the optical axis; 0 where unknown
  float static_log_odds = 0;                   ///< that it lies on something static
  float weight = 1;                            ///< what its residuals count for, 0 to 1
  bool moving() const { return weight <= 0; }  ///< left out because it moves
};

/// What a system thought of the keypoints of one frame.
struct LabeledFrame {
  std::size_t index = 0;
  double timestamp = 0;  ///< seconds
  std::vector<KeypointLabel> keypoints;
};

/// Verdicts of a whole sequence as a small binary file, 10 bytes a keypoint: little endian, packed.
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

/// Reads what LabelFile made. Throws Error for a file that cannot be read, is none, or ends
/// within a frame.
std::vector<LabeledFrame> read_labels(const std::filesystem::path& file);

}  // namespace stillmap
