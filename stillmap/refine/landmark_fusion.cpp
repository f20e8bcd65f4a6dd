// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/landmark_fusion.hpp"

#include "stillmap/base/trace.hpp"

namespace stillmap {

int fuse_duplicates(Map& map, KeyframeId keyframe, const FusionOptions& options) {
  const TraceScope scope("fusion");
  std::vector<KeyframeId> neighbours;
  for (const Covisible& c : map.covisible(keyframe, 15)) {
    if (neighbours.size() < static_cast<std::size_t>(options.neighbours))
      neighbours.push_back(c.keyframe);
  }
  int joined = 0;
  for (const KeyframeId neighbour : neighbours) {
    joined += fuse_into(map, neighbour, landmarks_seen_by(map, std::span(&keyframe, 1)), options);
  }
  return joined + fuse_into(map, keyframe, landmarks_seen_by(map, neighbours), options);
}

}  // namespace stillmap
