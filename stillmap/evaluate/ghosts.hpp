// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/geometry/voxel_key.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <opencv2/core.hpp>

namespace stillmap {

/// One frame with its true mask.
struct MaskedFrame {
  double timestamp = 0;  ///< Time of the frame [s].
  cv::Mat depth;  ///< Depth along the optical axis, height x width, 32FC1 [m]; 0 means unknown.
  /// Mask of the moving objects, height x width, 8UC1: 255 person, 128 other object, 0 static.
  cv::Mat mask;
};

/// Returns the next frame at each call; none after the last frame.
using MaskedFrames = std::function<std::optional<MaskedFrame>()>;

/// Returns the frames of `source` that have a mask in a folder of 8-bit PNGs named by timestamp in
/// seconds ("1000.033333.png"; the nearest within 10 ms). Frames without a mask are skipped.
/// `source` must outlive the result. Throws Error if the folder contains no such PNG or, while
/// reading, if a mask is unreadable.
MaskedFrames frames_with_masks(FrameSource& source, const std::filesystem::path& mask_folder);

/// Ground truth for the clouds of one sequence, in the truth's world: the volume swept by moving
/// objects, and the static surface, in voxels of 5 cm.
struct GhostReference {
  /// Voxels that contain masked pixels of at least one frame and no static pixels.
  std::unordered_set<Voxel> swept;
  /// Centers of mass of the static pixels in the voxels observed by at least 15 frames [m], ordered
  /// by voxel.
  std::vector<Eigen::Vector3f> surface;
  std::size_t frames = 0;               ///< Number of frames used.
  std::size_t frames_without_pose = 0;  ///< Number of frames skipped for lack of a true pose.

  /// Returns whether a point in the truth's world [m] lies in the swept volume.
  bool is_swept(const Eigen::Vector3d& p_truth) const;
};

/// Transforms the pixels of all frames into the world with the true poses and assigns them to
/// voxels. Pixels near the outline of a mask and at depth jumps count neither as moving nor as
/// static: sensors mix foreground and background there and masks are one or two pixels off, so that
/// people would appear in walls and walls in people. True poses are interpolated between timestamps
/// at most 0.1 s apart; frames without one are counted. Throws Error if depth, mask and camera
/// differ in size, or no frame could be used.
GhostReference make_ghost_reference(const MaskedFrames& frames, const Trajectory& truth,
                                    const Camera& camera);

/// Share of ghosts in a cloud, and share of the static surface that the cloud contains.
struct GhostFigures {
  std::size_t points = 0;   ///< Number of points in the cloud.
  std::size_t ghosts = 0;   ///< Number of points inside the swept volume.
  std::size_t surface = 0;  ///< Number of voxels of the static surface.
  std::size_t kept = 0;     ///< Number of surface voxels with a point of the cloud within reach.
  double ghost_share() const {
    return points == 0 ? 0 : static_cast<double>(ghosts) / static_cast<double>(points);
  }
  double surface_share() const {
    return surface == 0 ? 0 : static_cast<double>(kept) / static_cast<double>(surface);
  }
};

/// Returns 1 for each point inside the swept volume (a ghost), else 0.
/// @param points           points in the estimate's world [m]
/// @param T_truth_estimate transform from the estimate's world to the truth's: see align_worlds()
std::vector<std::uint8_t> mark_ghosts(const GhostReference& reference,
                                      std::span<const Eigen::Vector3f> points,
                                      const Pose& T_truth_estimate);

/// Returns the figures of a cloud; the arguments are those of mark_ghosts(). A voxel of the static
/// surface counts as kept if a point lies within 5 cm of its center of mass, so that a surface at
/// the border of two voxels is not lost in the one that the cloud's own filter left empty.
GhostFigures count_ghosts(const GhostReference& reference, std::span<const Eigen::Vector3f> points,
                          const Pose& T_truth_estimate);

/// Returns one line of text per figure.
std::string ghost_text(const GhostFigures& figures);
void to_json(nlohmann::json& json, const GhostFigures& figures);

}  // namespace stillmap
