// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// One thing that a network (or a folder of masks) found in an image.
struct Instance {
  int class_id = 0;        ///< index into the detector's class names
  std::string class_name;  ///< "person", "chair", ...; "unknown" where the source does not say
  float confidence = 1;    ///< 0 to 1
  cv::Rect box;            ///< pixels of the full image, clipped to it
  cv::Mat mask;  ///< 8UC1 of the box's size, 255 on the thing; empty where only a box is known
};

/// The instances in one frame; either found in that very frame (age 0) or carried forward from an
/// earlier one.
struct SegmentedFrame {
  std::size_t frame_index = 0;   ///< the frame whose pixels the instances are given in
  std::size_t source_index = 0;  ///< the frame the network saw
  std::vector<Instance> instances;
  std::size_t age() const { return frame_index - source_index; }  ///< frames
};

using SegmentedFramePtr = std::shared_ptr<const SegmentedFrame>;

}  // namespace stillmap
