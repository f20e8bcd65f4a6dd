// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/ghosts.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/evaluate/stamped_images.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

/// Edge length of the voxels of the swept volume and of the static surface [m].
constexpr double kVoxel = 0.05;
/// Width of the excluded band on both sides of mask outlines [pixels].
constexpr int kMaskMargin = 6;
/// Largest depth difference between a pixel and its neighbors, relative to its depth; pixels with a
/// larger one are excluded.
constexpr double kMaxJump = 0.02;
/// Largest standard deviation of a depth that counts [m]: half a voxel, and that of a Kinect v1 at
/// 4 m.
constexpr double kMaxSigma = 0.025824;
/// Distance between the evaluated pixels along both axes [pixels].
constexpr int kStride = 2;
/// Number of frames that must observe a voxel before it counts as static surface.
constexpr std::uint32_t kMinSurfaceFrames = 15;
/// Largest distance between a point of the cloud and the center of mass of a kept voxel [m].
constexpr double kSurfaceReach = 0.05;

Voxel voxel_near(const Eigen::Vector3d& p, double edge) {
  return voxel_of(clamped_lattice_at(p, edge));
}

/// Accumulated evidence of one voxel.
struct Evidence {
  Eigen::Vector3d static_sum = Eigen::Vector3d::Zero();  // of static pixels' positions
  std::uint32_t static_pixels = 0;
  std::uint32_t static_frames = 0;
  std::uint32_t last_static_frame = 0;  // 1-based, to count each frame once
  bool moving = false;
};

using EvidenceGrid = std::unordered_map<Voxel, Evidence>;

void check_frame(const MaskedFrame& frame, const Camera& camera) {
  const cv::Size size(camera.width, camera.height);
  if (frame.depth.size() == size && frame.depth.type() == CV_32FC1 && frame.mask.size() == size &&
      frame.mask.type() == CV_8UC1) {
    return;
  }
  throw Error(fmt::format("depth is {} x {} and mask {} x {}, the camera has {} x {} pixels",
                          frame.depth.cols, frame.depth.rows, frame.mask.cols, frame.mask.rows,
                          camera.width, camera.height),
              fmt::format("frame {:.6f}", frame.timestamp),
              "give depth as 32-bit float meters and masks as 8-bit images of the camera's size");
}

cv::Mat square(int radius) {
  return cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * radius + 1, 2 * radius + 1));
}

/// Returns the pixels with reliable depth: known, near enough, and without a jump to any of the
/// eight neighbors.
cv::Mat1b sound_depth(const cv::Mat& depth, const DepthSensor& sensor) {
  const float max_depth = sensor.depth_at_sigma(kMaxSigma);
  cv::Mat highest, lowest, far_where_unknown = depth.clone();
  far_where_unknown.setTo(1e6, depth <= 0);
  cv::dilate(depth, highest, square(1));
  cv::erode(far_where_unknown, lowest, square(1));
  const cv::Mat rise = highest - depth, fall = depth - lowest;
  const cv::Mat step = cv::max(rise, fall);
  return (depth > 0) & (depth <= max_depth) & (step <= kMaxJump * depth);
}

/// Adds the pixels of frames to the evidence of their voxels.
class FrameSorter {
 public:
  FrameSorter(EvidenceGrid& grid, const Camera& camera) : grid_(grid), camera_(camera) {}

  void add(const MaskedFrame& frame, const Pose& T_world_camera) {
    ++frame_;
    const cv::Mat1b sound = sound_depth(frame.depth, camera_.depth_sensor);
    cv::Mat near_mask, inside_mask;
    cv::dilate(frame.mask, near_mask, square(kMaskMargin));
    cv::erode(frame.mask, inside_mask, square(kMaskMargin));
    const Eigen::Matrix3d R = T_world_camera.rotation();
    for (int v = 0; v < camera_.height; v += kStride) {
      for (int u = 0; u < camera_.width; u += kStride) {
        const bool moving = inside_mask.at<std::uint8_t>(v, u) != 0;
        const bool still = near_mask.at<std::uint8_t>(v, u) == 0;
        if (!sound(v, u) || (!moving && !still)) continue;
        const double z = frame.depth.at<float>(v, u);
        add_pixel(R * camera_.unproject(u, v, z) + T_world_camera.translation(), moving);
      }
    }
  }

 private:
  void add_pixel(const Eigen::Vector3d& p_world, bool moving) {
    const Voxel key = voxel_near(p_world, kVoxel);
    if (last_ == nullptr || key != last_key_) {  // neighbors mostly share a voxel
      last_ = &grid_[key];
      last_key_ = key;
    }
    if (moving) {
      last_->moving = true;
      return;
    }
    last_->static_sum += p_world;
    ++last_->static_pixels;
    if (last_->last_static_frame != frame_) ++last_->static_frames;
    last_->last_static_frame = frame_;
  }

  EvidenceGrid& grid_;  // addresses of its elements stay valid when it grows
  const Camera& camera_;
  std::uint32_t frame_ = 0;
  Voxel last_key_ = 0;
  Evidence* last_ = nullptr;
};

/// Derives the swept volume and the static surface from the evidence. The surface is ordered by
/// voxel, so that the result does not depend on hashing.
void conclude(const EvidenceGrid& grid, GhostReference& reference) {
  std::vector<std::pair<Voxel, Eigen::Vector3f>> surface;
  for (const auto& [key, evidence] : grid) {
    if (evidence.moving && evidence.static_pixels == 0) reference.swept.insert(key);
    if (evidence.static_pixels > 0 && evidence.static_frames >= kMinSurfaceFrames) {
      surface.emplace_back(key, (evidence.static_sum / evidence.static_pixels).cast<float>());
    }
  }
  std::sort(surface.begin(), surface.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [key, center] : surface) reference.surface.push_back(center);
}

/// Points by cell, for queries of whether a point lies within kSurfaceReach.
class PointIndex {
 public:
  explicit PointIndex(std::vector<Eigen::Vector3d> points) : points_(std::move(points)) {
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      if (points_[i].allFinite()) cells_[voxel_near(points_[i], kSurfaceReach)].push_back(i);
    }
  }
  bool any_near(const Eigen::Vector3d& p) const {
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          if (any_near(p,
                       voxel_near(p + kSurfaceReach * Eigen::Vector3d(dx, dy, dz), kSurfaceReach)))
            return true;
        }
      }
    }
    return false;
  }

 private:
  bool any_near(const Eigen::Vector3d& p, Voxel cell) const {
    const auto found = cells_.find(cell);
    return found != cells_.end() &&
           std::any_of(found->second.begin(), found->second.end(), [&](std::uint32_t i) {
             return (points_[i] - p).squaredNorm() <= kSurfaceReach * kSurfaceReach;
           });
  }

  std::vector<Eigen::Vector3d> points_;
  std::unordered_map<Voxel, std::vector<std::uint32_t>> cells_;
};

std::vector<Eigen::Vector3d> transformed(std::span<const Eigen::Vector3f> points, const Pose& T) {
  std::vector<Eigen::Vector3d> result(points.size());
  std::transform(points.begin(), points.end(), result.begin(),
                 [&](const Eigen::Vector3f& p) { return T * Eigen::Vector3d(p.cast<double>()); });
  return result;
}

}  // namespace

MaskedFrames frames_with_masks(FrameSource& source, const fs::path& mask_folder) {
  return [&source, masks = StampedImages(mask_folder)]() -> std::optional<MaskedFrame> {
    while (const RgbdFramePtr frame = source.next()) {
      const cv::Mat mask = masks.at(frame->timestamp);
      if (!mask.empty()) return MaskedFrame{frame->timestamp, frame->depth, mask};
    }
    return std::nullopt;
  };
}

bool GhostReference::is_swept(const Eigen::Vector3d& p_truth) const {
  return p_truth.allFinite() && swept.contains(voxel_near(p_truth, kVoxel));
}

GhostReference make_ghost_reference(const MaskedFrames& frames, const Trajectory& truth,
                                    const Camera& camera) {
  GhostReference reference;
  EvidenceGrid grid;
  FrameSorter sorter(grid, camera);
  while (const std::optional<MaskedFrame> frame = frames()) {
    check_frame(*frame, camera);
    if (const std::optional<Pose> pose = pose_at(truth, frame->timestamp)) {
      sorter.add(*frame, *pose);
      ++reference.frames;
    } else {
      ++reference.frames_without_pose;
    }
  }
  if (reference.frames == 0) {
    throw Error(fmt::format("none of {} with a mask has a true pose",
                            counted(reference.frames_without_pose, "frame")),
                "ghost figure", "check that masks, frames and true trajectory belong together");
  }
  conclude(grid, reference);
  return reference;
}

std::vector<std::uint8_t> mark_ghosts(const GhostReference& reference,
                                      std::span<const Eigen::Vector3f> points,
                                      const Pose& T_truth_estimate) {
  std::vector<std::uint8_t> marks(points.size());
  std::transform(points.begin(), points.end(), marks.begin(), [&](const Eigen::Vector3f& p) {
    return reference.is_swept(T_truth_estimate * Eigen::Vector3d(p.cast<double>())) ? 1 : 0;
  });
  return marks;
}

GhostFigures count_ghosts(const GhostReference& reference, std::span<const Eigen::Vector3f> points,
                          const Pose& T_truth_estimate) {
  const PointIndex index(transformed(points, T_truth_estimate));
  const auto marks = mark_ghosts(reference, points, T_truth_estimate);
  GhostFigures figures;
  figures.points = points.size();
  figures.ghosts = static_cast<std::size_t>(std::count(marks.begin(), marks.end(), 1));
  figures.surface = reference.surface.size();
  figures.kept = static_cast<std::size_t>(
      std::count_if(reference.surface.begin(), reference.surface.end(),
                    [&](const Eigen::Vector3f& p) { return index.any_near(p.cast<double>()); }));
  return figures;
}

std::string ghost_text(const GhostFigures& figures) {
  return fmt::format(
      "ghosts: {} of {} points in the volume swept by moving objects = {:.4f} %\n"
      "static surface: {} of {} voxels kept = {:.2f} %\n",
      figures.ghosts, figures.points, 100 * figures.ghost_share(), figures.kept, figures.surface,
      100 * figures.surface_share());
}

void to_json(nlohmann::json& json, const GhostFigures& figures) {
  json = {{"points", figures.points},
          {"ghosts", figures.ghosts},
          {"ghost_share", figures.ghost_share()},
          {"surface_voxels", figures.surface},
          {"surface_voxels_kept", figures.kept},
          {"surface_share", figures.surface_share()}};
}

}  // namespace stillmap
