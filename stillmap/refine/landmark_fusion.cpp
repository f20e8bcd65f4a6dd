// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/landmark_fusion.hpp"

#include "stillmap/base/trace.hpp"

namespace stillmap {

int fuse_duplicates(Map& map, KeyframeId keyframe, const FusionOptions& options) {
  const TraceScope scope("fusion");
  std::vector<KeyframeId> neighbors;
  for (const Covisible& c : map.covisible(keyframe, 15)) {
    if (neighbors.size() < static_cast<std::size_t>(options.neighbors))
      neighbors.push_back(c.keyframe);
  }
  int joined = 0;
  for (const KeyframeId neighbor : neighbors) {
    joined += fuse_into(map, neighbor, landmarks_seen_by(map, std::span(&keyframe, 1)), options);
  }
  return joined + fuse_into(map, keyframe, landmarks_seen_by(map, neighbors), options);
}

}  // namespace stillmap
