// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/motion/frame.hpp"

#include <array>
#include <deque>
#include <string>
#include <vector>

namespace stillmap {

struct MoverDetectionOptions {
  /// Log-odds below which a surface that hangs together with a moving one belongs to it (Canny's
  /// second threshold: a trunk without texture between swinging arms).
  double grow_below = -0.3;
  int min_cells = 12;       ///< cells with depth that a mover must have
  double min_area = 0.015;  ///< and the area they cover, facing the camera [square meters]
  double min_moving = 0.3;  ///< share of a thing's cells that must move for it to be moving
  /// Pieces of one thing that something nearer cuts in two: joined where the gap between them and
  /// the difference of their depths are at most this [meters] ...
  double piece_gap = 0.3;
  double max_width = 0.7;   ///< ... and the whole is no wider than a person [meters]
  double max_length = 2.2;  ///< ... and no longer [meters]
  double trim = 0.02;  ///< share of the points cut off at both ends of each axis, as flying ones
  double max_half_depth = 0.2;  ///< what is not seen of a thing reaches no deeper [meters]
  int views = 10;               ///< remembered, to know what was there before
  double view_interval = 0.2;   ///< seconds between two of them
  double min_core = 0.2;        ///< share of a mover's cells that have neighbors of it on all sides
};

/// A thing along one of the camera's axes (x to the right, y down), as far as it is seen.
struct SeenSpan {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< in the world, of length 1
  double extent = 0;                               ///< of what is seen [m]
  /// Whether it goes on unseen at its low and its high end: there most of it ends at the image's
  /// border, or at something nearer.
  bool low_hidden = false, high_hidden = false;
};

/// Something that moves, or might, as one frame shows it. Meters, world frame.
struct MoverDetection {
  /// False for what is not sure to move: an instance that stands still (somebody who has stopped),
  /// or a surface that is taken for moving, but was there before.
  bool moves = true;
  std::string class_name = "unknown";  ///< of the instance that covers it; "unknown": none does
  double class_confidence = 0;         ///< the instance's confidence times the share it covers
  /// Mean of the surface that is seen: measured, but only the side turned to the camera.
  Eigen::Vector3d surface_mean = Eigen::Vector3d::Zero();
  /// Where the thing's centroid is taken to be: see MoverDetector.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d surface;    ///< around the surface seen, along the world's axes
  Eigen::AlignedBox3d box;        ///< the same, deepened away from the camera by what is not seen
  int cells = 0;                  ///< grid cells with depth
  cv::Rect image_box;             ///< [pixels]
  std::array<SeenSpan, 2> spans;  ///< along the camera's x and y axes
  /// The image's border may hide a part of it, or something nearer does.
  bool cut_off = false;
};

struct MoverDetections {
  std::vector<MoverDetection> movers;  ///< in the order of their first cell, row by row
  int too_small = 0;      ///< regions left out as they are smaller, or thinner, than movers are
  int without_depth = 0;  ///< regions left out as nearly no pixel of them has a depth
};

/// Takes what moves in a frame apart into things, on the frame's grid of cells.
///
/// Where surfaces were judged (preset `fused`), cells that move are the seeds, and cells that hang
/// together with them belong to the thing while their log-odds are below `grow_below`. Where masks
/// alone say what moves (the other presets), they are grown and carried from frame to frame, so
/// that they cover strips of the background, too; a cell is left out
/// - at the rim of a moving region, where flying pixels lie as well;
/// - where it shows what stood there before: its point is looked up in views of the last seconds,
///   and more of them saw that very surface without taking it for moving than saw it moving, or
///   nothing there. (Someone who sits still is taken for moving in all of them, so he stays.)
///
/// An instance is one thing as far as its mask reaches (the largest piece of it, if there are
/// several), whether or not all of it moves; if less than `min_moving` of it does, it is a
/// detection that stands still. What a mask takes in of the background around something that was
/// measured to move is left out where it was measured to stand.
///
/// What no instance covers must have come from elsewhere for it to be moving: its points are looked
/// up in the views of the last seconds, and more of them must fall where nothing was than on a
/// surface. Single surfaces that are wrongly taken for moving do the camera's pose no harm, but a
/// planner should not see them.
///
/// Neighboring cells (or next but one, over holes in the depth) are one region unless there is a
/// depth jump or two different instances between them; pieces cut apart by an occluder are joined
/// again by their distance and joint size, or as parts of one instance.
///
/// **What the camera does not see.** It sees a thing's front. Let r be half the thing's depth along
/// the ray. For an upright cylinder of radius r the mean of the seen surface, every pixel counting
/// alike, lies (1/2r) int sqrt(r^2 - x^2) dx = (pi/4) r before the axis; for a sphere it is (2/3)
/// r, for a flat front r. So the centroid is put (pi/4) r behind the surface's mean, along the ray.
/// How deep a thing is cannot be seen; it is taken to be as deep as it is wide: r = sqrt(3) times
/// the standard deviation across its longer image axis (half the width of an evenly spread set), at
/// most `max_half_depth`. A person's trunk is about 0.24 m deep and 0.45 m wide, so the error is
/// within some 6 cm whichever side is turned to the camera. `box` reaches to the surface's mirror
/// image behind the centroid, `surface` is what was measured.
class MoverDetector {
 public:
  explicit MoverDetector(const MoverDetectionOptions& options = {});

  /// The movers of the next frame, which must have cells and evidence; its instances may be null.
  MoverDetections detect(const Frame& frame, const Pose& T_world_camera);

  /// Forgets the views: a new world begins.
  void restart() { views_.clear(); }

 private:
  /// What was seen a while ago, one value per cell.
  struct View {
    double timestamp = 0;
    Pose T_camera_world;
    CellGridPtr cells;
    cv::Mat1b moves;
  };
  /// What a view shows where a point is now.
  enum class Sight { kNothing, kStanding, kMoving, kBeyond };

  cv::Mat1b background(const Frame& frame, const cv::Mat1b& moves,
                       const Pose& T_world_camera) const;
  void remember(View view);
  Sight sight(const View& view, const Eigen::Vector3d& p_world) const;
  bool stood_there(const Eigen::Vector3d& p_world) const;
  bool came_here(const std::vector<Eigen::Vector3d>& points, const Pose& T_world_camera) const;

  MoverDetectionOptions options_;
  std::deque<View> views_;
};

}  // namespace stillmap
