// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/run_details.hpp"
#include "stillmap/report/captioned_image.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// An event on the time line of a run: "lost", "new map", "loop closed", ...
struct RunEvent {
  double timestamp = 0;  ///< Time of the event [s].
  std::string text;      ///< Name of the event.
};

/// All data of a finished run. All result files, the report page and the printed summary are made
/// from it.
struct RunRecord : RunDetails {
  std::string sequence;             ///< Name of the sequence, for headings.
  std::string recording;            ///< Absolute path of the recording; empty if it is not known.
  std::string machine;              ///< Processor and number of cores.
  std::optional<Trajectory> truth;  ///< True trajectory, T_world_camera.
  std::optional<Evaluation> evaluation;      ///< Errors against the truth.
  std::string evaluation_problem;            ///< Reason why there is no evaluation despite a truth.
  std::vector<CaptionedImage> gallery;       ///< Example frames with keypoints and masks.
  std::optional<double> first_pose_seconds;  ///< Time from program start to the first pose [s].
  double mapping_memory_mib = 0;             ///< Peak memory before files are written [MiB].
  double peak_memory_mib = 0;                ///< Peak memory including the writing of files [MiB].
  std::vector<RunEvent> warnings;            ///< Events of the rules of --zones.
  bool interrupted = false;                  ///< Whether the user stopped the run early.

  /// Returns the number of frames per second of wall time [1/s].
  double frames_per_second() const;
  /// Returns the median of the tracking time per frame [ms]; 0 without frames.
  double tracking_median() const;
};

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
