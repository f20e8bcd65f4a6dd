// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/options.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/report/captioned_image.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// A saved map that a run started from.
struct LoadedMap {
  std::filesystem::path file;
  bool extended = true;  ///< Whether the run added to the map; false: it only localized the camera.
  double seconds = 0;    ///< Time taken to read the file [s].
};

/// An event on the time line of a run: "lost", "new map", "loop closed", ...
struct RunEvent {
  double timestamp = 0;  ///< Time of the event [s].
  std::string text;      ///< Name of the event.
};

/// All data of a finished run. All result files, the report page and the printed summary are made
/// from it.
struct RunRecord {
  std::string sequence;   ///< Name of the sequence, for headings.
  std::string recording;  ///< Absolute path of the recording; empty if it is not known.
  std::string machine;    ///< Processor and number of cores.
  Options options;        ///< All options in force.
  SlamResult result;      ///< Trajectory, map, movers and timing.
  std::string detector;   ///< Description of the object detector; empty: none.
  bool detector_gives_boxes_only = false;
  std::optional<SavedMap> map;      ///< The map to be saved; includes the views of the dense map.
  std::optional<LoadedMap> loaded;  ///< The map that the run started from.
  std::optional<Trajectory> truth;  ///< True trajectory, T_world_camera.
  std::optional<Evaluation> evaluation;  ///< Errors against the truth.
  std::string evaluation_problem;        ///< Reason why there is no evaluation despite a truth.
  std::vector<SkippedFrame> skipped;     ///< Frames that the source could not read.
  std::vector<CaptionedImage> gallery;   ///< Example frames with keypoints and masks.
  std::size_t frames = 0;                ///< Number of frames passed to the tracker.
  std::vector<double> dropped;           ///< Times of frames dropped because tracking was late [s].
  double seconds = 0;                    ///< Wall time of the run, without writing files [s].
  std::optional<double> first_pose_seconds;  ///< Time from program start to the first pose [s].
  double mapping_memory_mib = 0;             ///< Peak memory before files are written [MiB].
  double peak_memory_mib = 0;                ///< Peak memory including the writing of files [MiB].
  /// Remarks that do not put the results in doubt: settings without effect, a doubtful truth.
  std::vector<std::string> notes;
  std::vector<std::string> frame_problems;  ///< Of FrameCheck and of the rules of --zones.
  std::vector<std::string> doubts;          ///< Reasons not to trust the results.
  std::string planner_doubt;                ///< The one of them about the files for planners.
  std::vector<RunEvent> warnings;           ///< Events of the rules of --zones.
  bool interrupted = false;                 ///< Whether the user stopped the run early.
  bool recovered = false;                   ///< Whether the run was killed; from its journal.

  /// Returns the number of frames of the sequence: processed, dropped and unreadable ones.
  std::size_t total_frames() const { return frames + dropped.size() + frames_skipped(); }
  /// Returns the number of frames that the source could not read.
  std::size_t frames_skipped() const {
    return static_cast<std::size_t>(
        std::count_if(skipped.begin(), skipped.end(), [](const auto& s) { return s.frame_lost; }));
  }
  /// Returns the times of all frames that were dropped late, of a recording or a live camera [s].
  std::vector<double> late_frames() const;
  /// Returns the number of frames per second of wall time [1/s].
  double frames_per_second() const;
  /// Returns the median of the tracking time per frame [ms]; 0 without frames.
  double tracking_median() const;
};

/// Returns the number of frames of a run with a property, such as FrameRecord::relocalized.
std::size_t frames_with(const SlamResult& result, bool FrameRecord::*property);

/// Returns "loop", "merge" or "dropped".
const char* name_of(MapEvent::Kind kind);

/// Consecutive frames with the same verdict of the dynamics gate.
struct DynamicsPeriod {
  double begin = 0, end = 0;  ///< Times of its first frame and of the next frame after it [s].
  Dynamics dynamics = Dynamics::kLow;
};

/// Returns one line per frame: index, time [s], state of the tracker, numbers of keypoints, moving
/// keypoints and inliers, age of the masks [frames], and flags (0 or 1); cells without a value are
/// empty.
std::string frames_csv(const SlamResult& result);

/// Returns the verdicts of the dynamics gate over time; empty without a gate.
std::vector<DynamicsPeriod> dynamics_periods(const SlamResult& result);

/// Returns the events of tracking and mapping, ordered by time.
std::vector<RunEvent> run_events(const SlamResult& result);

/// Compares the trajectory with the truth, if there is one: sets `evaluation`, or
/// `evaluation_problem` if that fails.
void evaluate_run(RunRecord& record);

/// Returns the numbers of events, such as "2 loops closed, 1 relocalization"; empty without events.
std::string map_events_text(const SlamResult& result);

/// Returns the summary printed at the end of a run: coverage, map size, speed and errors; several
/// lines.
std::string run_summary_text(const RunRecord& record);

/// Returns the content of summary.json: counts, events, timing, errors and all options; units are
/// part of the key names.
nlohmann::json run_summary_json(const RunRecord& record);

}  // namespace stillmap
