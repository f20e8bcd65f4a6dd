// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/map/keyframe_proposal.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/refine/culling.hpp"
#include "stillmap/refine/landmark_creation.hpp"
#include "stillmap/refine/landmark_fusion.hpp"
#include "stillmap/refine/local_adjustment.hpp"
#include "stillmap/refine/repeated_landmarks.hpp"

#include <optional>

namespace stillmap {

struct MapperOptions {
  LandmarkCreationOptions creation;
  FusionOptions fusion;
  RepeatedOptions repeated;
  LocalAdjustmentOptions adjustment;
  CullingOptions culling;
  LocalMapOptions local_map;
  STILLMAP_FIELDS(creation, fusion, repeated, adjustment, culling, local_map)
};

/// What keeping one keyframe did, for the log and the summary.
struct RefineReport {
  int triangulated = 0, joined = 0, landmarks_culled = 0, keyframes_culled = 0;
  RepeatedReport repeated;  ///< by MapperOptions::repeated
  BundleResult adjustment;
};

/// What keeping all keyframes did.
struct RefineTotals {
  long triangulated = 0, joined = 0, landmarks_culled = 0, keyframes_culled = 0;
  long repeated_pairs = 0, repeated_gone = 0;
  void add(const RefineReport& report);
};

/// Keeps the map good around the newest keyframe. Synchronous: the pipeline gives it a thread.
class LocalMapper {
 public:
  /// The map may hold components already. Throws Error for options that make no sense.
  LocalMapper(Map& map, const MapperOptions& options);

  /// Adds the keyframe, what the tracker found in it, and landmarks for what it sees besides. A
  /// proposal without reference begins a new component. Returns the new keyframe.
  KeyframeId insert(const KeyframeProposal& proposal);

  /// Around the keyframe: more landmarks by triangulation, duplicates joined or removed, local
  /// bundle adjustment, culling. `stop` ends the adjustment early.
  RefineReport refine(KeyframeId newest, const StopRequest& stop = {});

  /// What the tracker may see of the map around a keyframe.
  LocalMapPtr local_map(KeyframeId reference) const {
    return make_local_map(map_, reference, options_.local_map);
  }

 private:
  RepeatedReport treat_repeated(KeyframeId newest);

  Map& map_;
  MapperOptions options_;
  std::optional<Vocabulary> vocabulary_;  // where a rule asks for it
  std::uint32_t next_component_ = 0;
};

}  // namespace stillmap
