// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/labeled_frame.hpp"

namespace stillmap {

LabeledFrame labeled_frame(const Frame& frame) {
  LabeledFrame labels{frame.index(), frame.timestamp(), {}};
  labels.keypoints.reserve(frame.features->size());
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    labels.keypoints.push_back(
        {k.u, k.v, k.depth, frame.evidence.static_log_odds[i], frame.evidence.weight[i]});
  }
  return labels;
}

}  // namespace stillmap
