// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/landmark_fusion.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/map/fusion.hpp"

namespace stillmap {
namespace {

/// Minimum number of landmarks that a neighbor shares with the keyframe.
constexpr int kMinShared = 15;
/// Search radius around the projection [pixels at level 0].
constexpr double kRadius = 3;

}  // namespace

int fuse_duplicates(Map& map, KeyframeId keyframe, int most) {
  const TraceScope scope("fusion");
  std::vector<KeyframeId> neighbors;
  for (const Covisible& c : map.covisible(keyframe, kMinShared)) {
    if (std::ssize(neighbors) < most) neighbors.push_back(c.keyframe);
  }
  int joined = 0;
  for (const KeyframeId neighbor : neighbors) {
    joined += fuse_into(map, neighbor, landmarks_seen_by(map, std::span(&keyframe, 1)), kRadius);
  }
  return joined + fuse_into(map, keyframe, landmarks_seen_by(map, neighbors), kRadius);
}

}  // namespace stillmap
