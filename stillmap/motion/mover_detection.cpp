// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_detection.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/motion/mover_regions.hpp"
#include "stillmap/motion/mover_shape.hpp"

namespace stillmap {
namespace {

/// Standard deviation of a depth up to which movers are detected [m]: that of a Kinect v1 at the
/// end of its range.
constexpr double kMaxSigma = 0.1;
/// Static log-odds below which a surface connected to a moving one belongs to it, such as a trunk
/// without texture between swinging arms (Canny's second threshold); chosen on simulated scenes.
constexpr double kGrowBelow = -0.3;
/// Minimum share of a region that an instance must cover to name it [0..1].
constexpr double kMinNamedShare = 0.3;
/// Length of the upper part of an object, and start of its lower part, from its upper end [m]: a
/// person's waist is 0.7 to 0.9 m below the top of the head.
constexpr double kUpperLength = 0.7, kLowerStart = 0.9;

/// Returns the index of the instance that covers each cell, the first of several.
cv::Mat1i instance_of_cells(const InstanceCellsPtr& cells, cv::Size grid) {
  cv::Mat1i instance(grid, kNoInstance);
  if (!cells) return instance;
  for (int i = static_cast<int>(cells->size()) - 1; i >= 0; --i)
    instance.setTo(i, (*cells)[static_cast<std::size_t>(i)]);
  return instance;
}

/// Returns 255 for each cell that is in the mask of the instance that covers it.
cv::Mat1b in_own_mask(const Frame& frame, const cv::Mat1i& instance) {
  cv::Mat1b inside(instance.size(), 0);
  if (!frame.instances) return inside;
  for (int i = 0; i < static_cast<int>(frame.instances->instances.size()); ++i) {
    const Instance& object = frame.instances->instances[static_cast<std::size_t>(i)];
    inside |= (instance == i) & cells_in_mask(object, *frame.cells);
  }
  return inside;
}

/// Returns 255 for each cell whose center pixel moves.
cv::Mat1b moving_cells(const Frame& frame) {
  cv::Mat1b moves(frame.cells->size(), 0);
  const cv::Mat& pixels = frame.evidence.moving_pixels;
  if (pixels.empty()) return moves;
  for (int y = 0; y < moves.rows; ++y) {
    for (int x = 0; x < moves.cols; ++x) {
      moves(y, x) =
          pixels.at<std::uint8_t>(y * kCellSide + kCellSide / 2, x * kCellSide + kCellSide / 2);
    }
  }
  return moves;
}

/// Returns 255 for each cell of a moving instance that was measured to be static: background that
/// its mask includes. Instances of which too few cells were measured to move may be people who
/// stand still, and keep all their cells.
cv::Mat1b static_within_instances(const cv::Mat1i& instance, const MotionEvidence& evidence) {
  cv::Mat1b background(instance.size(), 0);
  if (evidence.surface_measured.empty()) return background;
  double count = 0;
  cv::minMaxLoc(instance, nullptr, &count);
  for (int i = 0; i <= static_cast<int>(count); ++i) {
    const cv::Mat1b within = instance == i;
    const cv::Mat1b moving = within & (evidence.surface_measured < kGrowBelow);
    if (cv::countNonZero(moving) >= kMinMovingShare * cv::countNonZero(within))
      background |= within & (evidence.surface_measured > 0);
  }
  return background;
}

/// Returns 255 for each cell that moves by its mask alone: at the rim of the moving region, or on a
/// surface that was static in earlier views.
cv::Mat1b background_of_masks(const Frame& frame, const cv::Mat1b& moves,
                              const Pose& T_world_camera, const RecentViews& views) {
  const CellGrid& cells = *frame.cells;
  cv::Mat1b background = moves & ~without_rim(moves);
  for (int y = 0; y < moves.rows; ++y) {
    for (int x = 0; x < moves.cols; ++x) {
      const float z = cells.depth(y, x);
      if (moves(y, x) == 0 || background(y, x) != 0 || z == 0) continue;
      if (views.was_static(T_world_camera * cells.camera.unproject(x, y, z)))
        background(y, x) = 255;
    }
  }
  return background;
}

/// Returns the cells that may belong to a mover.
/// @param background 255 where a cell is known to belong to none
MoverGrid make_grid(const Frame& frame, const cv::Mat1b& moves, const cv::Mat1b& background) {
  const CellGrid& cells = *frame.cells;
  const cv::Mat1f& log_odds = frame.evidence.surface_log_odds;
  MoverGrid grid{.cells = cells,
                 .moves = moves & ~background,
                 .depth = cells.depth.clone(),
                 .instance = instance_of_cells(frame.instance_cells, cells.size()),
                 .in_mask = {}};
  grid.in_mask = in_own_mask(frame, grid.instance);
  cv::Mat1b part = moves | (grid.instance != kNoInstance);
  if (!log_odds.empty()) part |= log_odds < kGrowBelow;
  part &= ~static_within_instances(grid.instance, frame.evidence);
  const cv::Mat1b too_far = grid.depth > cells.camera.depth_sensor.depth_at_sigma(kMaxSigma);
  grid.depth.setTo(0, ~part | background | too_far);
  return grid;
}

void set_class(const InstanceCover& cover, const Frame& frame, MoverDetection& detection) {
  if (cover.instance == kNoInstance || cover.share < kMinNamedShare) return;
  const Instance& instance = frame.instances->instances[static_cast<std::size_t>(cover.instance)];
  detection.class_name = instance.class_name;
  detection.class_confidence = cover.share * instance.confidence;
}

/// Returns the colors of the pixels at the centers of a region's cells. Parts are measured from the
/// upper end of the object, so that a person whose legs are hidden has the same upper part.
Appearance appearance_of(const MoverRegion& region, const VisibleSpan& down, const cv::Mat& bgr) {
  Appearance appearance;
  if (bgr.empty() || down.low_hidden) return appearance;
  const double top = box_without_flying_pixels(region.points).min().y();
  for (std::size_t i = 0; i < region.cells.size(); ++i) {
    const double below = region.points[i].y() - top;
    if (below > kUpperLength && below < kLowerStart) continue;
    const cv::Point pixel = kCellSide * region.cells[i] + cv::Point(kCellSide / 2, kCellSide / 2);
    appearance.add(below < kLowerStart ? Appearance::Part::kUpper : Appearance::Part::kLower,
                   bgr.at<cv::Vec3b>(pixel));
  }
  return appearance;
}

}  // namespace

MoverDetections MoverDetector::detect(const Frame& frame, const Pose& T_world_camera) {
  const TraceScope scope("detect");
  const cv::Mat1b moves = moving_cells(frame);
  const bool has_surface_evidence = !frame.evidence.surface_log_odds.empty();
  const cv::Mat1b background = has_surface_evidence
                                   ? cv::Mat1b(moves.size(), 0)
                                   : background_of_masks(frame, moves, T_world_camera, views_);
  const MoverGrid grid = make_grid(frame, moves, background);

  MoverDetections result;
  result.without_depth = count_without_depth(grid);
  for (const MoverRegion& region : mover_regions(grid)) {
    const InstanceCover cover = cover_of(region, grid);
    MoverDetection detection;
    detection.moves = moving_share(region, grid) >= kMinMovingShare;
    if (cover.instance == kNoInstance)
      detection.moves &= views_.was_free(region.points, T_world_camera);
    if (!is_object(region, grid)) {
      result.too_small += detection.moves ? 1 : 0;
      continue;
    }
    measure_shape(region, grid, T_world_camera, detection);
    set_class(cover, frame, detection);
    detection.appearance = appearance_of(region, detection.spans[1], frame.image->color);
    result.movers.push_back(std::move(detection));
  }
  views_.add({frame.timestamp(), T_world_camera.inverse(), frame.cells, moves});
  return result;
}

}  // namespace stillmap
