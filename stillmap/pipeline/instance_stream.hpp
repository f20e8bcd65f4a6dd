// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/mask_carrier.hpp"

#include <deque>
#include <memory>
#include <set>
#include <string>

namespace stillmap {

/// All that the detector found in one frame, as it found it.
struct FoundThings {
  RgbdFramePtr image;  ///< null: nothing was looked at yet
  SegmentedFramePtr instances;
};

/// The detector in a thread of its own, at its own pace: frames go in, and every frame gets the
/// newest instances that are visible by then, carried forward to it.
class InstanceStream {
 public:
  /// @param detector null: no frame ever gets instances
  InstanceStream(std::unique_ptr<Detector> detector, const SlamOptions& options);

  /// Shows the detector a frame, if it is one of those it is to see.
  void push(const RgbdFramePtr& frame);

  /// Takes in what the detector found and is due by the frame pushed last: in lockstep waited for,
  /// in realtime what there is. Only the very first is always waited for: nothing may be mapped
  /// before it is known what moves.
  void collect();

  /// The newest instances collected, carried to the frame pushed last; null if there are none, or
  /// no detector.
  SegmentedFramePtr current() const;

  /// The newest collected, of all classes and not carried.
  const FoundThings& newest_found() const { return newest_found_; }

  void finish();
  const TimingRecorder& timing() const { return timing_; }  ///< after finish()
  std::size_t segmented() const { return segmented_; }  ///< frames the detector saw; after finish()

 private:
  FoundThings detect(const RgbdFramePtr& frame);
  SegmentedFrame wanted_in(const SegmentedFrame& found) const;

  const ScheduleOptions schedule_;
  std::unique_ptr<Detector> detector_;
  const std::set<std::string> wanted_classes_;
  TimingRecorder timing_;      // of the stage's thread until finish()
  std::size_t segmented_ = 0;  // likewise
  MaskCarrier carrier_;
  RgbdFramePtr newest_;
  FoundThings newest_found_;
  bool any_ = false;             // whether instances have come
  std::deque<std::size_t> due_;  // frame from which each result still to be taken is visible
  std::unique_ptr<Stage<RgbdFramePtr, FoundThings>> stage_;  // last: its thread uses the above
};

}  // namespace stillmap
