// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/loop_correction.hpp"

#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/loop/tag_matching.hpp"
#include "stillmap/map/fusion.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Search radius for welding the landmarks of both sides [pixels at level 0].
constexpr double kWeldRadius = 4;
/// Number of landmarks shared with the query or candidate from which a keyframe takes part in
/// welding, and maximum number of such keyframes of either side.
constexpr int kWeldShared = 15, kWeldMost = 15;
/// Weight of the loop's edge; all other edges have weight 1.
constexpr double kLoopWeight = 100;

/// Returns a keyframe and its most covisible keyframes within the component.
std::vector<KeyframeId> side_of(const Map& map, KeyframeId center) {
  return with_best_covisible(map, center, kWeldMost, kWeldShared);
}

/// Returns the keyframes of one side that are not on the other.
std::vector<KeyframeId> without(std::vector<KeyframeId> side, std::vector<KeyframeId> other) {
  std::sort(other.begin(), other.end());
  std::erase_if(side,
                [&](KeyframeId id) { return std::binary_search(other.begin(), other.end(), id); });
  return side;
}

/// Welds both sides: searches the landmarks of each side in the keyframes of the other.
int weld(Map& map, const std::vector<KeyframeId>& query_side,
         const std::vector<KeyframeId>& candidate_side) {
  const TraceScope scope("weld");
  int fused = 0;
  for (const KeyframeId id : query_side)
    fused += fuse_into(map, id, landmarks_seen_by(map, candidate_side), kWeldRadius);
  for (const KeyframeId id : candidate_side)
    fused += fuse_into(map, id, landmarks_seen_by(map, query_side), kWeldRadius);
  return fused + weld_tags(map, query_side, candidate_side);
}

}  // namespace

LoopCorrection close_loop(Map& map, const LoopMatch& match) {
  const std::uint32_t component = map.at(match.query).component;
  EssentialGraph graph(map, component);
  const auto candidate_side = side_of(map, match.candidate);
  const auto query_side = without(side_of(map, match.query), candidate_side);

  const Pose T_world_candidate = map.at(match.candidate).T_world_camera;
  const Pose T_wrong = map.at(match.query).T_world_camera;
  const Pose correction = T_world_candidate * match.T_candidate_query * T_wrong.inverse();
  std::map<KeyframeId, Pose> corrected;
  for (const KeyframeId id : query_side) {
    corrected[id] = correction * map.at(id).T_world_camera;
    graph.add(match.candidate, id, T_world_candidate.inverse() * corrected[id], kLoopWeight);
  }
  move_keyframes(map, corrected);
  LoopCorrection done;
  done.fused = weld(map, query_side, candidate_side);

  const Stopwatch watch;
  const KeyframeId first = graph.keyframes().front();
  move_keyframes(map, graph.relaxed({{first, map.at(first).T_world_camera}}));
  done.graph_ms = watch.milliseconds();
  map.add_loop(match.candidate, match.query);
  const Pose moved = map.at(match.query).T_world_camera * T_wrong.inverse();
  done.meters = (map.at(match.query).T_world_camera.translation() - T_wrong.translation()).norm();
  done.radians = moved.angle();
  done.keyframes = graph.keyframes().size();
  return done;
}

LoopCorrection join_maps(Map& map, const LoopMatch& match) {
  const auto query_side = side_of(map, match.query);
  const auto candidate_side = side_of(map, match.candidate);
  const std::uint32_t of_query = map.at(match.query).component;
  const std::uint32_t of_candidate = map.at(match.candidate).component;
  const Pose T_wrong = map.at(match.query).T_world_camera;
  const Pose to_candidates_world =
      map.at(match.candidate).T_world_camera * match.T_candidate_query * T_wrong.inverse();
  if (of_candidate < of_query) {
    map.move_component(of_query, to_candidates_world);
  } else {
    map.move_component(of_candidate, to_candidates_world.inverse());
  }
  map.join_components(std::min(of_query, of_candidate), std::max(of_query, of_candidate));

  LoopCorrection done;
  done.fused = weld(map, query_side, candidate_side);
  map.add_loop(match.candidate, match.query);
  done.meters = ((to_candidates_world * T_wrong).translation() - T_wrong.translation()).norm();
  done.radians = to_candidates_world.angle();
  done.keyframes = keyframes_of(map, std::min(of_query, of_candidate)).size();
  return done;
}

void propagate_correction(Map& map, const EssentialGraph& before) {
  constexpr double kMoved = 1e-9;  // Larger changes than this are no rounding error [m and rad].
  std::map<KeyframeId, Pose> held;
  for (const KeyframeId id : before.keyframes()) {
    if (map.find(id) == nullptr) continue;
    const Pose T = map.at(id).T_world_camera;
    const bool moved = (before.pose(id).inverse() * T).log().norm() > kMoved;
    if (moved || id == before.keyframes().front()) held[id] = T;
  }
  std::map<KeyframeId, Pose> relaxed = before.relaxed(held);
  std::erase_if(relaxed, [&](const auto& entry) { return held.contains(entry.first); });
  std::erase_if(relaxed, [&](const auto& entry) { return map.find(entry.first) == nullptr; });
  move_keyframes(map, relaxed);
}

}  // namespace stillmap
