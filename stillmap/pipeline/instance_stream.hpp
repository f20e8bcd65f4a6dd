// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/instance_cells.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/mask_propagator.hpp"

#include <deque>
#include <memory>
#include <set>
#include <string>

namespace stillmap {

/// All that the detector found in one frame, as it found it.
struct DetectedObjects {
  RgbdFramePtr image;  ///< null: nothing was looked at yet
  SegmentedFramePtr instances;
};

/// What is known of instances by one frame.
struct SeenInstances {
  SegmentedFramePtr carried;  ///< in this frame's pixels; null: none, or too old
  InstanceCellsPtr propagated_cells;
  DetectedObjects found;    ///< what they were found as: of all classes, and not carried
  double milliseconds = 0;  ///< time that propagating the masks took [ms], waiting not included
};

/// The detector in a thread of its own, at its own pace, and behind it another one that carries:
/// frames go in, and every frame gets the newest instances that are visible by then, carried
/// forward to it. Meanwhile the caller may do what needs no masks.
class InstanceStream {
 public:
  /// @param detector null: no frame ever gets instances
  InstanceStream(std::unique_ptr<Detector> detector, const SlamParameters& options);

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
  std::size_t segmented() const { return segmented_; }  ///< frames the detector saw; after finish()
  /// Detector::skipped() at the end; after finish().
  const std::string& skipped() const { return skipped_; }

 private:
  struct PropagationTask {
    RgbdFramePtr frame;
    CellGridPtr cells;
    std::size_t visible = 0;  // how many results there are by then, since the beginning
  };

  DetectedObjects detect(const RgbdFramePtr& frame);
  SeenInstances carry_to(const PropagationTask& task);
  void collect(std::size_t visible);
  void take_in(const DetectedObjects& found);
  SegmentedFrame wanted_in(const SegmentedFrame& found) const;

  const ScheduleOptions schedule_;
  const std::set<std::string> wanted_classes_;
  std::deque<std::size_t> due_;  // frame from which each result still to come is visible
  std::size_t visible_ = 0;      // results that are

  // Of the detector's thread until finish().
  std::unique_ptr<Detector> detector_;
  std::size_t segmented_ = 0;
  std::string skipped_;

  // Of the propagator's thread until finish().
  MaskPropagator propagator_;
  DetectedObjects newest_found_;
  std::size_t taken_ = 0;  // results

  // Last, for their threads use the above, and the second one the first.
  std::unique_ptr<Stage<RgbdFramePtr, DetectedObjects>> detect_stage_;
  std::unique_ptr<Stage<PropagationTask, SeenInstances>> propagation_stage_;
};

}  // namespace stillmap
