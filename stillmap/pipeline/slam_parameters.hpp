// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/loop/places.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/options.hpp"
#include "stillmap/refine/local_mapper.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/segment_options.hpp"
#include "stillmap/track/tracker.hpp"

namespace stillmap {

/// Rules for when the results of other threads become visible to the tracker. In lockstep each
/// becomes visible at a fixed later frame, and the tracker waits for it if it is late, so that the
/// output depends on the data alone; in realtime it becomes visible as soon as it is ready. All
/// delays and intervals are in frames.
struct ScheduleOptions {
  bool realtime = false;     ///< Whether the schedule is realtime instead of lockstep.
  int insert_delay = 1;      ///< Delay of a new keyframe's landmarks (lockstep).
  int refine_delay = 5;      ///< Delay of the refined map around a new keyframe (lockstep).
  int relocalize_delay = 1;  ///< Delay of a relocalization result (lockstep).
  int global_delay = 90;     ///< Delay of global bundle adjustment after a loop (lockstep).
  /// Interval of the network's frames; in realtime the shortest one. 0: 1 if the detector is
  /// immediate, otherwise 3.
  int segment_every = 0;
  /// Delay of a frame's masks (lockstep); with 0 the tracker also waits for them in realtime. -1: 0
  /// if the detector is immediate, otherwise 2.
  int mask_delay = -1;
  int max_mask_age = 30;  ///< Maximum age of propagated masks.
};

/// Detection and tracking of moving objects.
struct MoverOptions {
  bool enabled = true;  ///< Whether moving objects are tracked.
};

/// The parameters of all algorithms, module by module; parameters_of() derives them from the
/// user's Options.
struct SlamParameters {
  OrbOptions orb;
  std::string tags = "none";     ///< Family of tags that are landmarks: see TagDetector.
  double disparity_sigma = 0.3;  ///< See Camera::disparity_sigma.
  SegmentOptions segment;
  MotionOptions motion;
  TrackerOptions tracker;
  MapperOptions mapper;
  PlaceOptions places;
  DenseOptions dense;
  MoverOptions movers;
  ScheduleOptions schedule;
  bool dense_cloud = true;  ///< Makes the dense map.
  /// Memory for the features of keyframes; others are kept in a file in dense.memory.folder
  /// [bytes].
  std::uint64_t keyframe_memory = 30000000;
  bool final_adjustment = true;  ///< Runs bundle adjustment on the whole map at the end.
  /// Whether the trajectory is smoothed at the end.
  bool smooth_trajectory = true;
};

/// Returns the parameters that follow from the user's options; the others keep their defaults.
/// Throws Error for an option outside its range.
SlamParameters parameters_of(const Options& options);

/// Returns the parameters of the dense map alone, from the same options as parameters_of().
DenseOptions dense_parameters_of(const Options& options);

/// Throws Error for a class of objects in the options that does not exist, and names the nearest
/// ones. The classes of COCO and "unknown" exist always, those of the detector if there is one.
void check_classes(const Options& options, const Detector* detector);

}  // namespace stillmap
