// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// One object detected in an image, by a network or from a folder of masks.
struct Instance {
  int class_id = 0;        ///< Index into the detector's class names.
  std::string class_name;  ///< Class name such as "person"; "unknown" if the source has none.
  float confidence = 1;    ///< Confidence [0..1].
  cv::Rect box;            ///< Box in the full image, clipped to it [pixels].
  cv::Mat
      mask;  ///< Mask, 8UC1 of the box's size, 255 on the object; empty if only the box is known.
};

/// Instances of one frame, either detected in this frame (age 0) or propagated from an earlier one.
struct SegmentedFrame {
  std::size_t frame_index = 0;   ///< Frame whose pixels the instances refer to.
  std::size_t source_index = 0;  ///< Frame in which the instances were detected.
  std::vector<Instance> instances;
  std::size_t age() const { return frame_index - source_index; }  ///< Age of the masks [frames].
};

using SegmentedFramePtr = std::shared_ptr<const SegmentedFrame>;

}  // namespace stillmap
