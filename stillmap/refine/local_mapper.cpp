// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/local_mapper.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/keypoint_depths.hpp"
#include "stillmap/map/tag_landmarks.hpp"

#include <algorithm>
#include <utility>

namespace stillmap {
namespace {

void note_matches(Map& map, const Keyframe& keyframe, const std::vector<LandmarkId>& landmarks) {
  for (std::uint32_t i = 0; i < landmarks.size(); ++i) {
    if (landmarks[i].valid() && map.observe(landmarks[i], {keyframe.id, i}))
      map.refresh(landmarks[i]);
  }
}

}  // namespace

void RefineTotals::add(const RefineReport& report) {
  triangulated += report.triangulated;
  fused += report.fused;
  landmarks_culled += report.landmarks_culled;
  keyframes_culled += report.keyframes_culled;
  repeated.insert(repeated.end(), report.repeated.begin(), report.repeated.end());
}

LocalMapper::LocalMapper(Map& map, const MapperOptions& options) : map_(map), options_(options) {}

KeyframeId LocalMapper::insert(const KeyframeProposal& proposal) {
  const bool begins_component = !proposal.reference.valid();
  Keyframe made;
  made.component = begins_component ? map_.new_component()
                                    : map_.at(map_.current_keyframe(proposal.reference)).component;
  made.frame_index = proposal.frame->index();
  made.timestamp = proposal.frame->timestamp();
  made.T_world_camera = begins_component
                            ? proposal.T_reference_camera
                            : map_.resolve(proposal.reference, proposal.T_reference_camera);
  made.features = without_depth_error(proposal.frame->features, map_.depth_error(),
                                      proposal.frame->depth_error, map_.camera());
  made.static_weight = proposal.frame->evidence.weight;
  const Keyframe& keyframe = map_.add_keyframe(std::move(made));
  for (const VisibilityCount& s : proposal.visibility_counts) {
    map_.count_visibility(s.landmark, s.predicted, s.found);
    map_.set_static_log_odds(s.landmark, s.static_log_odds);
  }
  note_matches(map_, keyframe, proposal.landmarks);
  observe_tags(map_, keyframe.id);
  erase_repeated(proposal.repeated);
  create_from_depth(
      map_, keyframe.id,
      proposal.starts_part() ? options_.max_first_landmark_sigma : options_.max_landmark_sigma,
      options_.fewest_depth_landmarks);
  return keyframe.id;
}

RefineReport LocalMapper::refine(KeyframeId newest, const StopRequest& stop) {
  RefineReport report;
  report.landmarks_culled = cull_landmarks(map_, newest);
  report.triangulated = create_by_triangulation(map_, newest, options_.max_landmark_sigma);
  report.fused = fuse_duplicates(map_, newest, options_.fusion_keyframes);
  report.repeated = std::exchange(repeated_, {});
  report.adjustment = adjust_locally(map_, newest, options_.local_window, stop);
  report.keyframes_culled = cull_keyframes(map_, newest);
  return report;
}

/// Erases landmarks and keeps their positions for the report.
void LocalMapper::erase_repeated(const std::vector<LandmarkId>& repeated) {
  for (const LandmarkId id : repeated) {
    const Landmark* landmark = map_.find(id);
    if (landmark == nullptr) continue;
    repeated_.push_back(landmark->p_world);
    map_.erase(id);
  }
}

}  // namespace stillmap
