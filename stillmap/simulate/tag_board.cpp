// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/tag_board.hpp"

#include "stillmap/simulate/paint_tools.hpp"
#include "stillmap/tag/tag_detector.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap::simulate {
namespace {

using Eigen::Vector3d;

constexpr const char* kFamily = "tag36h11";
constexpr int kSide = 512;  // Side of a print: a power of two, not resampled [texels].
constexpr int kCell = 50;   // Side of a cell [texels].
constexpr float kMetersPerTexel = 5e-4F;  // A pixel sees two to four texels at 1 m.
constexpr float kThickness = 0.012F;      // Thickness of a board [m].
constexpr float kGap = 0.001F;            // Gap behind it [m].

/// Returns the front of a board. Edges of cells lie between texels.
cv::Mat print_of(std::uint32_t id) {
  cv::Mat cells;
  cv::resize(tag_image(kFamily, id), cells, {}, kCell, kCell, cv::INTER_NEAREST);
  cv::Mat print(kSide, kSide, CV_8UC3, paint::kPaper);
  const cv::Rect middle((kSide - cells.cols) / 2, (kSide - cells.rows) / 2, cells.cols, cells.rows);
  print(middle).setTo(paint::kInk, cells == 0);
  return print;
}

/// Returns the corners of the black border, in the world frame.
std::array<Vector3d, 4> border_corners(const Transform& T) {
  const double half = 0.5 * kMetersPerTexel * kCell * tag_border(kFamily).width;
  const double front = -(kGap + kThickness);
  const Eigen::Isometry3d T_world_tag = T.cast<double>();
  return {T_world_tag * Vector3d(-half, front, -half), T_world_tag * Vector3d(half, front, -half),
          T_world_tag * Vector3d(half, front, half), T_world_tag * Vector3d(-half, front, half)};
}

}  // namespace

void hang_tags(std::span<const Transform> places, Palette& palette, Scene& scene) {
  constexpr float kWidth = kSide * kMetersPerTexel;
  MeshBuilder boards;
  for (std::uint32_t id = 0; id < places.size(); ++id) {
    const BoxSkin skin(palette.add(print_of(id)), palette.white);
    boards.box(places[id] * place(0, -kGap - kThickness / 2, -kWidth / 2),
               {kWidth, kThickness, kWidth}, skin, false);
    scene.tags.push_back({id, border_corners(places[id])});
  }
  append_transformed(boards.mesh(), Transform::Identity(), 0, scene.statics);
}

}  // namespace stillmap::simulate
