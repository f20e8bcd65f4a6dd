// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/loop/places.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/refine/local_mapper.hpp"
#include "stillmap/segment/mask_propagator.hpp"
#include "stillmap/segment/segment_options.hpp"
#include "stillmap/track/tracker.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// When results become visible. In lockstep each at a fixed later frame, waited for if it is late,
/// so that the output depends on the data alone; in realtime as soon as they are there.
struct ScheduleOptions {
  std::string mode = "lockstep";  ///< lockstep | realtime
  int insert_delay = 1;  ///< frames until the tracker sees a new keyframe's landmarks (lockstep)
  int refine_delay = 5;  ///< frames until it sees the map adjusted around it (lockstep)
  int relocalize_delay = 1;  ///< frames until it hears whether a place was recognized (lockstep)
  int global_delay =
      90;  ///< frames after a loop until the map adjusted as a whole is taken in (lockstep)
  int segment_every =
      3;  ///< frames from one that the network sees to the next (lockstep; realtime: at most)
  int mask_delay = 2;  ///< frames until the tracker sees its masks (lockstep)
  STILLMAP_FIELDS(mode, insert_delay, refine_delay, relocalize_delay, global_delay, segment_every,
                  mask_delay)
  bool realtime() const { return mode == "realtime"; }
};

/// What moves, as objects.
struct MoverOptions {
  bool enabled = true;  ///< whether movers are tracked
  MoverDetectionOptions detection;
  MoverTrackerOptions tracking;
  STILLMAP_FIELDS(enabled, detection, tracking)
};

/// Everything that can be set, room by room.
struct SlamOptions {
  OrbOptions orb;
  SegmentOptions segment;
  PropagationOptions carry;
  MotionOptions motion;
  TrackerOptions tracker;
  MapperOptions mapper;
  PlaceOptions places;
  DenseOptions dense;
  MoverOptions movers;
  ScheduleOptions schedule;
  bool dense_cloud = true;       ///< whether to make the dense cloud
  bool final_adjustment = true;  ///< bundle adjustment over the whole map at the end
  STILLMAP_FIELDS(orb, segment, carry, motion, tracker, mapper, places, dense, movers, schedule,
                  dense_cloud, final_adjustment)
};

/// Overrides options from a YAML file of the same nesting. Throws Error with file, line and the
/// nearest known name for an unknown key, and for a value of the wrong type.
void load_options(const std::filesystem::path& file, SlamOptions& options);

/// Overrides one option: "tracker.min_inliers=30". Lists are separated by commas. Throws Error as
/// above.
void set_option(const std::string& assignment, SlamOptions& options);

/// Throws Error for values that make no sense (a negative count, an unknown schedule).
void check_options(const SlamOptions& options);

/// All options in force, as YAML that load_options() reads back, or as JSON for the summary.
std::string options_yaml(const SlamOptions& options);
nlohmann::json options_json(const SlamOptions& options);

}  // namespace stillmap
