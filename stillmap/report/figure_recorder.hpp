// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_sink.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Draws the figures of chosen frames, and of the maps before and after the removal of movers:
///
///   figures/FRAME_objects.png      boxes and masks in the color of their class
///   figures/FRAME_flow.png         optical flow of the keypoints
///   figures/FRAME_keypoints.png    all keypoints and the kept ones
///   figures/FRAME_depth.png        depth with and without movers
///   figures/sparse_map.png         landmarks with and without the dropped keypoints of keyframes
///   figures/repeated_landmarks.png  landmarks with and without those erased as repeats, if any
class FigureRecorder final : public RunSink {
 public:
  /// @param frames          indices of the frames; empty: no figures at all
  /// @param movable_classes classes that are left out of the dense map
  /// @param folder          must outlive this object
  /// Throws Error for a negative index.
  FigureRecorder(std::vector<int> frames, std::vector<std::string> movable_classes,
                 ResultFolder& folder);

  void on_frame(SlamSystem& slam) override;
  /// Writes the figures of the maps.
  void on_results(RunRecord& record) override;

 private:
  /// Keypoints of a keyframe that were dropped as moving: u, v [pixels] and depth [m].
  struct Dropped {
    double timestamp;  // [s]
    std::vector<Eigen::Vector3d> keypoints;
  };

  void draw(const Frame& frame);
  void record_dropped(const Frame& frame);
  void draw_sparse(const RunRecord& record);

  std::vector<int> frames_;
  std::vector<std::string> movable_classes_;
  ResultFolder& folder_;
  FlowTracker flow_;
  FramePtr previous_;
  std::vector<Dropped> dropped_;
};

}  // namespace stillmap
