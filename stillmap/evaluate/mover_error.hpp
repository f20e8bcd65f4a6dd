// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

/// How well moving things were tracked, by the CLEAR MOT metrics (Bernardin and Stiefelhagen,
/// Evaluating Multiple Object Tracking Performance, EURASIP JIVP 2008) and the identity measures of
/// Ristani et al., Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking,
/// ECCV workshops 2016.
namespace stillmap {

/// Where one thing is, or is said to be, at one time. Meters, meters per second.
struct MoverPosition {
  double timestamp = 0;  ///< seconds
  int id = 0;
  std::string class_name;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  bool observed = true;     ///< of an estimate: seen at that time; else predicted
  int pixels = 0;           ///< of a truth: of the image that show it
  double shown = 1;         ///< of a truth: share of it in view and not covered
  Eigen::AlignedBox3d box;  ///< along the world's axes; empty where the file has none
};

/// Reads movers.csv of a run or truth_movers.csv of a simulated sequence: comma-separated, columns
/// found by the names in the first line (timestamp, id, class, x, y, z, vx, vy, vz; also state,
/// pixels, shown, min_x ... max_z where there are such), lines that begin with # left out. Throws
/// Error with file and line.
std::vector<MoverPosition> read_movers(const std::filesystem::path& file);

struct MoverErrorOptions {
  /// Meters between a thing's centroid and an estimate of it (Bernardin: 500 mm). Of what stands
  /// close before the camera only a part is seen: an estimate within its box is of it, too.
  double max_distance = 0.5;
  int min_pixels = 600;          ///< a thing shown by fewer does not count as seen
  double min_speed = 0.1;        ///< one whose centroid is slower counts as at rest [m/s]
  double max_difference = 0.01;  ///< seconds between stamps of one frame
  bool predicted = false;        ///< whether estimates count where they are mere predictions
};

/// Figures over all frames. A frame's *misses* are things that count and that no estimate is
/// matched to; its *false positives* are estimates matched to nothing. Things that do not count
/// (nearly or wholly hidden, or at rest) may be matched, but that is neither right nor wrong.
struct MoverErrors {
  std::size_t frames = 0;           ///< of the truth, within the time looked at
  std::size_t things = 0;           ///< true ones that count in at least one frame
  std::size_t tracks = 0;           ///< ids in the estimate
  std::size_t positions = 0;        ///< true positions that count: things times frames
  std::size_t matches = 0;          ///< of them those that were found
  std::size_t misses = 0;           ///< of them those that were not
  std::size_t false_positives = 0;  ///< estimates where nothing is
  std::size_t switches = 0;      ///< a thing is matched to another id than when it was matched last
  std::size_t false_tracks = 0;  ///< ids that were never matched to anything
  Statistics position;           ///< |estimate - truth| over the matches [m]; its mean is MOTP
  Statistics position_shown;     ///< the same for things of which 80 % are shown [m]
  Statistics position_ground;    ///< the same along the ground, the truth's world's x and y [m]
  Statistics velocity;           ///< |estimate - truth| over the matches [m/s]
  double position_p95 = 0, velocity_p95 = 0;  ///< [m], [m/s]
  /// Share of the matches at which the estimate's class is the truth's.
  double class_share = 0;
  /// 1 - (misses + false positives + switches) / positions; may be negative.
  double mota = 0;
  /// 2 IDTP / (positions + estimates): IDTP is the number of matches left when every thing is given
  /// one id only for the whole time, so that there are most.
  double idf1 = 0;
};

/// The estimate's world to the truth's, from whole poses: the rotation is the chordal mean of
/// R_truth R_estimate^T over the pairs (Hartley et al., Rotation Averaging, IJCV 2013,
/// section 5.3), the translation the mean of what is left. Unlike an alignment of positions it is
/// well defined for a camera that stands still or moves along a line. Throws Error where no stamps
/// pair.
Pose align_poses(const Trajectory& truth, const Trajectory& estimate);

/// Compares tracks with the truth, frame by frame: a match of the frame before is kept while it is
/// within `max_distance`; the rest is matched with the least sum of distances.
///
/// @param T_truth_estimate the estimate's world to the truth's: see align_poses()
/// @param first, last      stamps between which frames count [s]: those of the trajectory
MoverErrors compare_movers(const std::vector<MoverPosition>& truth,
                           const std::vector<MoverPosition>& estimate, const Pose& T_truth_estimate,
                           double first, double last, const MoverErrorOptions& options = {});

/// As a few lines of text.
std::string mover_error_text(const MoverErrors& errors);

/// For nlohmann::json: everything above, units in the key names.
void to_json(nlohmann::json& json, const MoverErrors& errors);

}  // namespace stillmap
