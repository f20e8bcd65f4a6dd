// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/motion/appearance.hpp"
#include "stillmap/motion/frame.hpp"
#include "stillmap/motion/recent_views.hpp"

#include <array>
#include <string>
#include <vector>

namespace stillmap {

/// The visible extent of an object along one of the camera's axes (x right, y down).
struct VisibleSpan {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< Unit vector, world frame.
  double extent = 0;                               ///< Length of the visible part [m].
  /// Whether the object may continue beyond its low and its high end: most of that end is at the
  /// image border or at a nearer surface.
  bool low_hidden = false, high_hidden = false;
};

/// An object of one frame that moves or may move. Meters, world frame.
struct MoverDetection {
  /// False for an instance that stands still (a person who has stopped), and for a surface with
  /// motion evidence that was in the same place before.
  bool moves = true;
  std::string class_name = "unknown";  ///< Class of the instance that covers it, if one does.
  double class_confidence = 0;  ///< Confidence of the instance times the share it covers [0..1].
  /// Mean of the visible surface, which is the side turned to the camera [m].
  Eigen::Vector3d surface_mean = Eigen::Vector3d::Zero();
  /// Estimated centroid of the whole object [m]; see MoverDetector.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d surface;  ///< Box around the visible surface, along the world's axes [m].
  Eigen::AlignedBox3d box;      ///< Box around the whole object, extended away from the camera [m].
  int cells = 0;                ///< Number of grid cells with depth.
  cv::Rect image_box;           ///< Box in the image [pixels].
  std::array<VisibleSpan, 2> spans;  ///< Along the camera's x and y axes.
  bool cut_off = false;   ///< Whether the image border or a nearer surface may hide a part of it.
  Appearance appearance;  ///< Colors of its cells; empty if its upper end is hidden.
};

struct MoverDetections {
  std::vector<MoverDetection> movers;  ///< Ordered by their first cell, row by row.
  int too_small = 0;      ///< Number of moving regions left out as smaller or thinner than movers.
  int without_depth = 0;  ///< Number of moving regions left out as nearly no pixel has a depth.
};

/// Divides the moving parts of a frame into objects, on the frame's grid of cells.
///
/// With surface evidence (preset `fused`), moving cells are the seeds, and connected cells belong
/// to the object while their static log-odds are below a second threshold. With masks alone (the
/// other presets), the masks are dilated and propagated from frame to frame and therefore include
/// strips of the background; a cell is left out
/// - at the rim of a moving region, which includes flying pixels;
/// - on a static surface of earlier views: most views of the last seconds with a surface or free
///   space at its point have that surface without motion evidence. (A person who sits still has
///   motion evidence in all of them and is kept.)
///
/// An instance is one object as far as its mask reaches (the largest of several pieces), whether or
/// not all of it moves; if less than a share of 0.3 moves, the detection counts as standing still.
/// Background in the mask of a moving instance is left out where it was measured to be static.
/// A piece of surface of which most cells are not in the mask, but in the margin around it, is left
/// out: furniture in front of a hidden person, or the wall behind.
///
/// A region without an instance must have arrived from elsewhere to count as moving: most views of
/// the last seconds must have seen through its points. A single surface wrongly labeled as moving
/// does not harm the camera's pose, but planners should not receive it.
///
/// Neighboring cells (or next but one, across holes in the depth) are one region unless there is a
/// depth jump or two different instances between them; pieces cut apart by an occluder are joined
/// again by their distance and joint size, or as parts of one instance.
///
/// **Hidden sides.** The camera observes the front of an object. Let r be half the object's depth
/// along the ray. For an upright cylinder of radius r the mean of the visible surface, every pixel
/// counting alike, lies (1/2r) int sqrt(r^2 - x^2) dx = (pi/4) r in front of the axis; for a sphere
/// (2/3) r, for a flat front r. So the centroid is set (pi/4) r behind the surface's mean, along
/// the ray. The depth of an object is not observable; it is assumed to equal the width: r = sqrt(3)
/// times the standard deviation across its longer image axis (half the width of an evenly spread
/// set), at most 0.2 m. A person's trunk is about 0.24 m deep and 0.45 m wide, so the error is
/// within some 6 cm for every orientation. `box` reaches to the surface's mirror image behind the
/// centroid, `surface` is the measured part.
class MoverDetector {
 public:
  /// Returns the movers of the next frame, which must have cells and evidence; its instances may be
  /// null.
  MoverDetections detect(const Frame& frame, const Pose& T_world_camera);

  /// Moves the views along with a corrected world.
  void move(const Pose& T_corrected_world) { views_.move(T_corrected_world); }
  /// Forgets the views: a new world begins.
  void restart() { views_.clear(); }

 private:
  RecentViews views_;
};

}  // namespace stillmap
