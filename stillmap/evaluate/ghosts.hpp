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
  double timestamp = 0;  ///< seconds
  cv::Mat depth;         ///< height x width, 32FC1 meters along the optical axis; 0 where unknown
  cv::Mat mask;  ///< height x width, 8UC1: not zero on what moves (255 person, 128 other thing)
};

/// Hands out one frame after the other, then nothing.
using MaskedFrames = std::function<std::optional<MaskedFrame>()>;

/// Frames of `source` with the masks of a folder of 8-bit PNGs whose names are the frames' stamps
/// in seconds
/// ("1000.033333.png"; the nearest within 10 ms). Frames without a mask are passed over. Both
/// arguments must outlive the result. Throws Error where the folder holds no such PNG or, while
/// reading, a mask is broken.
MaskedFrames frames_with_masks(FrameSource& source, const std::filesystem::path& mask_folder);

struct GhostOptions {
  double voxel = 0.05;  ///< side of all voxels [m]
  int mask_margin = 6;  ///< pixels this near to the mask's outline, on either side, are left out
  double max_jump =
      0.02;        ///< and pixels whose depth differs more from a neighbor's, relative to it
  int stride = 2;  ///< every n-th pixel in both directions is looked at
  int min_surface_frames =
      15;  ///< voxels of the static surface were seen in at least so many frames
  double surface_reach =
      0.05;  ///< a surface voxel is kept if a point is this near to its center of mass [m]
};

/// What clouds of one sequence are measured against, in the truth's world: the volume swept by what
/// moved, and the static surface.
struct GhostReference {
  GhostOptions options;
  /// Voxels that masked pixels of any frame fall into and no static pixel does.
  std::unordered_set<Voxel> swept;
  /// Centers of mass of the static pixels in each voxel that enough frames saw, ordered by voxel
  /// [m].
  std::vector<Eigen::Vector3f> surface;
  std::size_t frames = 0;               ///< used
  std::size_t frames_without_pose = 0;  ///< left out

  bool is_swept(const Eigen::Vector3d& p_truth) const;
};

/// Puts all pixels of all frames into the world with the true poses and sorts them into voxels.
/// Pixels near the outline of a mask and at depth jumps count neither as moving nor as static:
/// sensors mix foreground and background there and masks are a pixel or two off, so that people
/// would turn up in walls and walls in people. True poses are interpolated between stamps at most
/// 0.1 s apart; frames without one are counted. Throws Error where depth, mask and camera do not
/// fit together, or no frame could be used.
GhostReference make_ghost_reference(const MaskedFrames& frames, const Trajectory& truth,
                                    const Camera& camera, const GhostOptions& options = {});

/// How many ghosts a cloud holds, and how much of the static surface.
struct GhostFigures {
  std::size_t points = 0;   ///< of the cloud
  std::size_t ghosts = 0;   ///< of these inside the swept volume
  std::size_t surface = 0;  ///< voxels of the static surface
  std::size_t kept = 0;     ///< of these with a point of the cloud within reach
  double ghost_share() const {
    return points == 0 ? 0 : static_cast<double>(ghosts) / static_cast<double>(points);
  }
  double surface_share() const {
    return surface == 0 ? 0 : static_cast<double>(kept) / static_cast<double>(surface);
  }
};

/// Which points are ghosts: 1 for those inside the swept volume, else 0.
/// @param points           in the estimate's world [m]
/// @param T_truth_estimate the estimate's world in the truth's, as AteResult gives it
std::vector<std::uint8_t> mark_ghosts(const GhostReference& reference,
                                      std::span<const Eigen::Vector3f> points,
                                      const Pose& T_truth_estimate);

/// The figures of a cloud; arguments as in mark_ghosts. The static surface counts as kept where a
/// point lies within `surface_reach` of a voxel's center of mass, so that a surface at the border
/// of two voxels is not lost in the one that the cloud's own filter happened to leave empty.
GhostFigures count_ghosts(const GhostReference& reference, std::span<const Eigen::Vector3f> points,
                          const Pose& T_truth_estimate);

/// One line of text per figure.
std::string ghost_text(const GhostFigures& figures);
void to_json(nlohmann::json& json, const GhostFigures& figures);

}  // namespace stillmap
