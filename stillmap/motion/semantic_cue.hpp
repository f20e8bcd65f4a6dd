// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/class_sets.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <set>
#include <string>

namespace stillmap {

struct SemanticCueOptions {
  ClassSets classes = people_classes();  ///< the dynamic ones count, the others do not
  /// A keypoint's descriptor covers a disc around it; one this close to a mask is partly on the
  /// mover.
  int dilation = 5;  ///< pixels
  /// The same where other cues speak of surfaces too: a prior only, which what is measured may
  /// overrule.
  double prior = 4;
};

/// Keypoints inside the mask (or box, where there is no mask) of a thing whose class moves by
/// itself. The whole of SLAM3-YOLOv8's motion test.
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
