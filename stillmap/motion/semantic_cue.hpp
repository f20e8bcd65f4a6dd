// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/class_sets.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <set>
#include <string>

namespace stillmap {

struct SemanticCueOptions {
  ClassSets classes = people_classes();  ///< Only the dynamic ones are used.
  /// Dilation of the masks [pixels], as a descriptor covers a disc around its keypoint. The papers
  /// name none; their presets set it to 0.
  int dilation = 5;
  /// Decrease of a surface's log-odds with surface evidence from other cues, whose measurements may
  /// outweigh it.
  double prior = 4;
};

/// Labels keypoints inside the dilated mask, or else the box, of an object of a dynamic class as
/// moving: without dilation the whole motion test of SLAM3-YOLOv8 (Xie et al. 2025, section 2.2).
class SemanticCue : public MotionCue {
 public:
  explicit SemanticCue(const SemanticCueOptions& options);
  std::string_view name() const override { return "semantic"; }
  std::set<std::string> classes() const override;
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  bool is_dynamic(const Instance& instance) const;
  cv::Mat1f prior_of_surfaces(const SegmentedFrame& segmented, const InstanceCells& cells) const;

  SemanticCueOptions options_;
};

}  // namespace stillmap
