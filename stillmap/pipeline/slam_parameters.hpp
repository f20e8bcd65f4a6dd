// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/loop/places.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/options.hpp"
#include "stillmap/refine/local_mapper.hpp"
#include "stillmap/segment/mask_propagator.hpp"
#include "stillmap/segment/segment_options.hpp"
#include "stillmap/track/tracker.hpp"

namespace stillmap {

/// When the results of other threads become visible to the tracker. In lockstep each does at a
/// fixed later frame and is waited for if it is late, so that the output depends on the data alone;
/// in realtime each does as soon as it is ready. All times are in frames.
struct ScheduleOptions {
  bool realtime = false;     ///< Whether the schedule is realtime instead of lockstep.
  int insert_delay = 1;      ///< Delay of a new keyframe's landmarks (lockstep).
  int refine_delay = 5;      ///< Delay of the refined map around a new keyframe (lockstep).
  int relocalize_delay = 1;  ///< Delay of the answer whether a place was recognized (lockstep).
  int global_delay = 90;     ///< Delay of the map adjusted as a whole after a loop (lockstep).
  int segment_every = 3;     ///< Interval of the network's frames; in realtime the shortest one.
  int mask_delay = 2;        ///< Delay of a frame's masks (lockstep).
};

/// Detection and tracking of moving objects.
struct MoverOptions {
  bool enabled = true;  ///< Whether moving objects are tracked.
};

/// The parameters of all algorithms, module by module; parameters_of() derives them from the
/// user's Options.
struct SlamParameters {
  OrbOptions orb;
  SegmentOptions segment;
  PropagationOptions propagation;
  MotionOptions motion;
  TrackerOptions tracker;
  MapperOptions mapper;
  PlaceOptions places;
  DenseOptions dense;
  MoverOptions movers;
  ScheduleOptions schedule;
  bool dense_cloud = true;       ///< Whether the dense map is made.
  bool final_adjustment = true;  ///< Whether the whole map is adjusted at the end.
};

/// The parameters that follow from the user's options; the others keep their defaults. Throws Error
/// for an option outside its range.
SlamParameters parameters_of(const Options& options);

/// The parameters of the dense map alone; options as in parameters_of().
DenseOptions dense_parameters_of(const Options& options);

}  // namespace stillmap
