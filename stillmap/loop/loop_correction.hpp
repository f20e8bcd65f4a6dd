// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/essential_graph.hpp"
#include "stillmap/loop/loop_verification.hpp"

namespace stillmap {

/// Summary of a loop closure or merge, for log and run summary.
struct LoopCorrection {
  double meters = 0, radians = 0;  ///< Correction of the query keyframe's pose [m and rad].
  int fused = 0;                   ///< Number of merged landmarks and gained observations.
  /// Number of keyframes of the component, all of which may have moved.
  std::size_t keyframes = 0;
  double graph_ms = 0;  ///< Time of the pose graph optimization [ms].
};

/// Closes a loop within one component: the query and its neighbors move to the matched pose with
/// their landmarks; landmarks of both sides are welded; the other keyframes follow by pose graph
/// optimization of the essential graph (Mur-Artal, Montiel and Tardos, TRO 2015, section VII.C-D;
/// in SE(3), since the scale is known). The component's first keyframe stays fixed. The caller runs
/// global bundle adjustment: see whole_component().
LoopCorrection close_loop(Map& map, const LoopMatch& match);

/// Merges two components: the younger one moves rigidly to the matched pose, becomes part of the
/// older one, and landmarks of both are welded. The caller adjusts the seam and then calls
/// propagate_correction().
LoopCorrection join_maps(Map& map, const LoopMatch& match);

/// Propagates a correction: keyframes that were moved and the first keyframe stay fixed, all others
/// are optimized by the essential graph.
/// @param before  essential graph from before the correction
void propagate_correction(Map& map, const EssentialGraph& before);

}  // namespace stillmap
