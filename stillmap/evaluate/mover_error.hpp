// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

/// Tracking errors of moving objects: the CLEAR MOT metrics (Bernardin and Stiefelhagen, Evaluating
/// Multiple Object Tracking Performance, EURASIP JIVP 2008) and the identity measures of Ristani et
/// al., Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking, ECCV workshops
/// 2016.
namespace stillmap {

/// True or estimated state of one moving object at one time, in the world frame of its file.
struct MoverPosition {
  double timestamp = 0;  ///< Time of the frame [s].
  int id = 0;            ///< Identity of the object in its file.
  std::string class_name;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< Position in the world [m].
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< Velocity in the world [m/s].
  bool observed = true;  ///< Estimates only: the object was observed in this frame, not predicted.
  int pixels = 0;        ///< Ground truth only: number of image pixels that show the object.
  double shown = 1;      ///< Ground truth only: unoccluded share of the object in view [0..1].
  Eigen::AlignedBox3d box;  ///< Box along the world's axes [m]; empty if the file has none.
};

/// Reads movers.csv of a run or truth_movers.csv of a simulated sequence. The file is
/// comma-separated; its columns are found by the names in the first line: timestamp, id, class, x,
/// y, z, vx, vy, vz, and optionally state, pixels, shown, min_x ... max_z. Lines that begin with #
/// are ignored. Throws Error with file and line for a malformed file.
std::vector<MoverPosition> read_movers(const std::filesystem::path& file);

/// Figures over all frames. A true object is *required* in a frame if at least 600 pixels show it
/// and its centroid moves at 0.1 m/s or more. A frame's *misses* are required objects without a
/// matched estimate; its *false positives* are estimates that match no object. Objects that are not
/// required (nearly or fully occluded, or at rest) may be matched, but this counts neither as
/// correct nor as wrong.
struct MoverErrors {
  std::size_t frames = 0;           ///< Number of ground truth frames within the evaluated time.
  std::size_t things = 0;           ///< Number of objects required in at least one frame.
  std::size_t tracks = 0;           ///< Number of ids in the estimate.
  std::size_t positions = 0;        ///< Number of required positions, over all objects and frames.
  std::size_t matches = 0;          ///< Number of required positions with a matched estimate.
  std::size_t misses = 0;           ///< Number of required positions without a matched estimate.
  std::size_t false_positives = 0;  ///< Number of estimates that match no object.
  std::size_t switches = 0;         ///< Number of times an object is matched to another id.
  std::size_t false_tracks = 0;     ///< Number of ids that never match an object.
  Statistics position;              ///< |estimate - truth| over the matches [m]; its mean is MOTP.
  Statistics position_shown;   ///< Position error of objects that are at least 80 % visible [m].
  Statistics position_ground;  ///< Position error along x and y of the truth's world [m].
  Statistics velocity;         ///< |estimate - truth| over the matches [m/s].
  double position_p95 = 0, velocity_p95 = 0;  ///< 95 % quantiles of the errors [m], [m/s].
  double class_share = 0;  ///< Share of the matches with the correct class [0..1].
  /// MOTA, 1 - (misses + false positives + switches) / positions; may be negative.
  double mota = 0;
  /// IDF1, 2 IDTP / (positions + estimates). IDTP is the largest number of matches that an
  /// assignment of one id to each object for the whole sequence can reach.
  double idf1 = 0;
};

/// Compares tracks with the truth, frame by frame: a match of the previous frame is kept while
/// the two centroids are within 0.5 m or the estimate is inside the object's box; the remaining
/// objects and estimates are matched with the smallest sum of distances. Predicted positions do not
/// count as estimates.
///
/// @param T_truth_estimate transform from the estimate's world to the truth's: see align_worlds()
/// @param first, last      first and last timestamp of the trajectory; frames outside do not count
/// [s]
MoverErrors compare_movers(const std::vector<MoverPosition>& truth,
                           const std::vector<MoverPosition>& estimate, const Pose& T_truth_estimate,
                           double first, double last);

/// Returns the figures as a few lines of text.
std::string mover_error_text(const MoverErrors& errors);

/// Writes all figures with units in the key names (for nlohmann::json).
void to_json(nlohmann::json& json, const MoverErrors& errors);

}  // namespace stillmap
