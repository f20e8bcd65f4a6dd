// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/motion/instance_cells.hpp"
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

/// What is known of instances by one frame.
struct SeenInstances {
  SegmentedFramePtr carried;  ///< in this frame's pixels; null: none, or too old
  InstanceCellsPtr carried_cells;
  FoundThings found;        ///< what they were found as: of all classes, and not carried
  double milliseconds = 0;  ///< of carrying
};

/// The detector in a thread of its own, at its own pace, and behind it another one that carries:
/// frames go in, and every frame gets the newest instances that are visible by then, carried
/// forward to it. Meanwhile the caller may do what needs no masks.
class InstanceStream {
 public:
  /// @param detector null: no frame ever gets instances
  InstanceStream(std::unique_ptr<Detector> detector, const SlamOptions& options);

  /// Shows the detector a frame, if it is one of those it is to see, and begins to carry to it what
  /// is due by then: in lockstep that is waited for, in realtime it is what there is. Only the
  /// instances of the very first frame are always waited for: nothing may be mapped before it is
  /// known what moves.
  void push(const RgbdFramePtr& frame, const CellGridPtr& cells);

  /// Waits for the instances in the frame pushed last. Call once for each.
  SeenInstances take();

  /// Waits for all that was pushed, and lets the detector go, with its memory. Nothing may be
  /// pushed any more.
  void finish();
  TimingRecorder timing() const;                        ///< after finish()
  std::size_t segmented() const { return segmented_; }  ///< frames the detector saw; after finish()

 private:
  struct CarryTask {
    RgbdFramePtr frame;
    CellGridPtr cells;
    std::size_t visible = 0;  // how many results there are by then, since the beginning
  };

  FoundThings detect(const RgbdFramePtr& frame);
  SeenInstances carry_to(const CarryTask& task);
  double collect(std::size_t visible);
  void take_in(const FoundThings& found);
  SegmentedFrame wanted_in(const SegmentedFrame& found) const;

  const ScheduleOptions schedule_;
  const std::set<std::string> wanted_classes_;
  std::deque<std::size_t> due_;  // frame from which each result still to come is visible
  std::size_t visible_ = 0;      // results that are

  // Of the detector's thread until finish().
  std::unique_ptr<Detector> detector_;
  TimingRecorder detecting_;
  std::size_t segmented_ = 0;

  // Of the carrier's thread until finish().
  MaskCarrier carrier_;
  TimingRecorder carrying_;
  FoundThings newest_found_;
  std::size_t taken_ = 0;  // results

  // Last, for their threads use the above, and the second one the first.
  std::unique_ptr<Stage<RgbdFramePtr, FoundThings>> detect_stage_;
  std::unique_ptr<Stage<CarryTask, SeenInstances>> carry_stage_;
};

}  // namespace stillmap
