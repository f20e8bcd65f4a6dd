// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/refine/local_mapper.hpp"

#include <deque>
#include <map>
#include <memory>

namespace stillmap {

/// The mapper in a thread of its own: proposals go in, snapshots of the map come out. Owns the map.
class Mapping {
 public:
  Mapping(const Camera& camera, const PyramidShape& pyramid, const SlamOptions& options);

  /// Hands over a keyframe. Two snapshots will follow: with its landmarks, and adjusted.
  void push(const KeyframeProposal& proposal);

  /// The snapshot that the tracker is to use for a frame: in lockstep the newest that is due by
  /// then, waited for; in realtime the newest there is. After a proposal that begins a map its
  /// snapshot is waited for in both.
  LocalMapPtr local_map_for(std::size_t frame_index);

  /// Waits for all that was pushed and, if asked to by the options, adjusts the whole map once
  /// more. From here on the map may be read.
  void finish();

  const Map& map() const { return map_; }                   ///< after finish()
  const TimingRecorder& timing() const { return timing_; }  ///< after finish()
  std::uint32_t components() const { return components_; }
  /// The keyframe made of a frame; invalid if none was. After finish().
  KeyframeId keyframe_of(std::size_t frame_index) const;

 private:
  void work(const KeyframeProposal& proposal, const std::function<void(LocalMapPtr)>& publish);

  const ScheduleOptions schedule_;
  const bool final_adjustment_;
  const BundleOptions bundle_;
  // Of the stage's thread until finish().
  Map map_;
  LocalMapper mapper_;
  TimingRecorder timing_;
  std::map<std::size_t, KeyframeId> keyframe_of_;

  std::uint32_t components_ = 0;
  bool await_first_ = false;     // a map was begun, and its first snapshot has not been taken yet
  std::deque<std::size_t> due_;  // frame from which each snapshot still to be taken is visible
  LocalMapPtr newest_;
  std::unique_ptr<Stage<KeyframeProposal, LocalMapPtr>> stage_;  // last: its thread uses the above
};

}  // namespace stillmap
