// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/loop/essential_graph.hpp"
#include "stillmap/loop/loop_verification.hpp"
#include "stillmap/map/fusion.hpp"

namespace stillmap {

struct LoopCorrectionOptions {
  FusionOptions fusion{.radius = 4};  ///< of the landmarks of both sides
  int weld_shared = 15;      ///< landmarks shared with the query, or the candidate, that make a
                             ///< keyframe take part in the welding
  int weld_most = 15;        ///< keyframes of either side that take part at most, the best
  int strong = 100;          ///< landmarks shared that make an edge of the essential graph
  double loop_weight = 100;  ///< of the loop's edge in it; the others have 1
  PoseGraphOptions graph;
  STILLMAP_FIELDS(fusion, weld_shared, weld_most, strong, loop_weight, graph)
};

/// What was done about a match, for the log and the summary.
struct LoopCorrection {
  double meters = 0, radians = 0;  ///< by which the query keyframe was moved
  int fused = 0;                   ///< landmarks merged, and observations gained
  std::size_t keyframes = 0;       ///< of the component, all of which may have moved
  double graph_ms = 0;             ///< spent on the pose graph
};

/// Closes a loop within one component: the query and its neighbors move to where the match says,
/// with what they saw; landmarks that both sides know become one; and the rest of the component
/// follows by its essential graph (Mur-Artal, Montiel and Tardos, TRO 2015, section VII.C-D; in
/// SE(3), since the scale is known). The component's first keyframe stays. Bundle adjustment of the
/// whole is for the caller: see whole_component().
LoopCorrection close_loop(Map& map, const LoopMatch& match,
                          const LoopCorrectionOptions& options = {});

/// Joins two components at a match: the younger one moves as a whole to where the match says (its
/// poses relative to each other stay), becomes part of the older one, and landmarks that both know
/// become one. Adjusting the seam, and propagate_correction() after it, is for the caller.
LoopCorrection join_maps(Map& map, const LoopMatch& match,
                         const LoopCorrectionOptions& options = {});

/// After some of a component's keyframes were moved: those stay, and the first one, and all others
/// give way by the essential graph.
/// @param before  made before they were moved
void propagate_correction(Map& map, const EssentialGraph& before, const PoseGraphOptions& options);

}  // namespace stillmap
