// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/verdict_frame.hpp"

namespace stillmap {

VerdictFrame verdict_frame(const Frame& frame) {
  VerdictFrame verdicts{frame.index(), frame.timestamp(), {}};
  verdicts.keypoints.reserve(frame.features->size());
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    verdicts.keypoints.push_back(
        {k.u, k.v, k.depth, frame.evidence.static_log_odds[i], frame.evidence.weight[i]});
  }
  return verdicts;
}

}  // namespace stillmap
