// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/mask_carrier.hpp"

#include <deque>
#include <memory>

namespace stillmap {

/// The detector in a thread of its own, at its own pace: frames go in, and every frame gets the
/// newest instances that are visible by then, carried forward to it.
class InstanceStream {
 public:
  /// @param detector null: no frame ever gets instances
  InstanceStream(std::unique_ptr<Detector> detector, const SlamOptions& options);

  /// Shows the detector a frame, if it is one of those it is to see. Call before instances_for().
  void push(const RgbdFramePtr& frame);

  /// The instances for the frame pushed last; null if there are none yet, or no detector. Only the
  /// very first are always waited for: nothing may be mapped before it is known what moves.
  SegmentedFramePtr instances();

  void finish();
  const TimingRecorder& timing() const { return timing_; }  ///< after finish()
  std::size_t segmented() const { return segmented_; }  ///< frames the detector saw; after finish()

 private:
  SegmentedFramePtr detect(const RgbdFramePtr& frame);

  const ScheduleOptions schedule_;
  std::unique_ptr<Detector> detector_;
  TimingRecorder timing_;      // of the stage's thread until finish()
  std::size_t segmented_ = 0;  // likewise
  MaskCarrier carrier_;
  RgbdFramePtr newest_;
  bool any_ = false;             // whether instances have come
  std::deque<std::size_t> due_;  // frame from which each result still to be taken is visible
  std::unique_ptr<Stage<RgbdFramePtr, SegmentedFramePtr>>
      stage_;  // last: its thread uses the above
};

}  // namespace stillmap
