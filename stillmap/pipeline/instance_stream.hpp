// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/instance_cells.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/pipeline/stage.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/mask_propagator.hpp"

#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>

namespace stillmap {

/// All instances that the detector found in one frame.
struct DetectedObjects {
  RgbdFramePtr image;  ///< Frame that was segmented; null: none yet.
  SegmentedFramePtr instances;
};

/// The detector of a run and the schedule of its masks.
struct DetectorUse {
  std::optional<InferenceInfo> inference;  ///< Library and device; none for a folder of masks.
  int every = 0;                           ///< Interval of the frames that are segmented [frames].
  int mask_delay = 0;  ///< ScheduleOptions::mask_delay as it is in force [frames].
};

/// Instances that are known when a frame is tracked.
struct FrameInstances {
  /// Instances propagated to this frame; null: none, or the newest are too old.
  SegmentedFramePtr propagated;
  InstanceCellsPtr propagated_cells;  ///< The cells that the propagated masks cover.
  DetectedObjects detected;           ///< Newest detections, of all classes and in their own frame.
  double milliseconds = 0;            ///< Time taken by the propagation, without waiting [ms].
};

/// Detection and mask propagation, each on its own thread. Every pushed frame gets the newest
/// instances that are visible to it, propagated to its image, while the caller does other work.
class InstanceStream {
 public:
  /// Name of the thread that propagates masks.
  static constexpr const char* kThread = "masks";

  /// @param detector null: no frame ever gets instances
  InstanceStream(std::unique_ptr<Detector> detector, const SlamParameters& options);

  /// Passes the frame to the detector, if it is to be segmented, and starts to propagate the
  /// visible instances to it. In lockstep, and with a mask delay of 0, the stream waits for these;
  /// otherwise they are the newest available. The stream always waits for the instances of the very
  /// first frame, so that no moving object gets into the map.
  void push(const RgbdFramePtr& frame, const CellGridPtr& cells);

  /// Waits for the instances in the frame pushed last and returns them. Called once per frame.
  FrameInstances wait();

  /// Waits for all frames pushed and destroys the detector, which frees its memory. Nothing may be
  /// pushed after it.
  void finish();
  /// Returns the detector and its schedule; none without a detector.
  const std::optional<DetectorUse>& use() const { return use_; }
  /// Returns the number of frames segmented. Called after finish().
  std::size_t segmented() const { return segmented_; }
  /// Returns Detector::skipped() at the end of the run. Called after finish().
  const std::string& skipped() const { return skipped_; }
  /// Returns Detector::failures() at the end of the run. Called after finish().
  std::size_t failures() const { return failures_; }
  /// Returns Detector::finding() at the end of the run. Called after finish().
  const std::optional<Finding>& finding() const { return finding_; }

 private:
  struct PropagationTask {
    RgbdFramePtr frame;
    CellGridPtr cells;
    std::size_t visible = 0;  // number of segmented frames that are visible to this frame
  };

  DetectedObjects detect(const RgbdFramePtr& frame);
  FrameInstances propagate(const PropagationTask& task);
  void collect(std::size_t visible);
  void accept(const DetectedObjects& detected);
  SegmentedFrame wanted_in(const SegmentedFrame& found) const;

  const ScheduleOptions schedule_;
  const std::optional<DetectorUse> use_;
  const bool waits_;  // whether frames wait for the instances that are visible to them
  const std::set<std::string> wanted_classes_;
  std::deque<std::size_t> due_;  // first frame to which each pending segmentation is visible
  std::size_t visible_ = 0;      // number of segmented frames that are visible by now

  // Used by the detector's thread until finish().
  std::unique_ptr<Detector> detector_;
  std::size_t segmented_ = 0;
  std::string skipped_;
  std::size_t failures_ = 0;
  std::optional<Finding> finding_;

  // Used by the propagation thread until finish().
  MaskPropagator propagator_;
  DetectedObjects newest_;
  std::size_t accepted_ = 0;  // number of segmented frames accepted

  // The threads are last, since they use the members above; the second one uses the first.
  std::unique_ptr<Stage<RgbdFramePtr, DetectedObjects>> detect_stage_;
  std::unique_ptr<Stage<PropagationTask, FrameInstances>> propagation_stage_;
};

}  // namespace stillmap
