// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/figure_recorder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/pipeline/dense_stream.hpp"
#include "stillmap/report/method_images.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr int kFlowWindow = 9;  // pixels, as in the cue of gated-seg

}  // namespace

FigureRecorder::FigureRecorder(std::vector<int> frames, std::vector<std::string> movable_classes,
                               ResultFolder& folder)
    : frames_(std::move(frames)),
      movable_classes_(std::move(movable_classes)),
      folder_(folder),
      flow_(kFlowWindow) {
  for (const int frame : frames_) {
    if (frame >= 0) continue;
    throw Error(fmt::format("there is no frame {}", frame), "--figures",
                "give indices of frames from 0 on, such as 30,60");
  }
}

void FigureRecorder::on_frame(SlamSystem& slam) {
  if (frames_.empty()) return;
  const TrackedFrame& tracked = *slam.newest();
  const Frame& frame = *tracked.frame;
  if (tracked.proposal || tracked.state == TrackState::kStarted) record_dropped(frame);
  const auto index = static_cast<int>(frame.index());
  if (std::find(frames_.begin(), frames_.end(), index) != frames_.end()) draw(frame);
  previous_ = tracked.frame;
}

void FigureRecorder::draw(const Frame& frame) {
  const auto write = [&](const char* kind, const cv::Mat& image) {
    folder_.write_drawing(fmt::format("figures/{:06}_{}.png", frame.index(), kind),
                          [&](const fs::path& file) { write_png(file, image); });
  };
  write("objects", draw_objects(frame));
  MotionInput input;
  input.image = frame.image;
  input.features = frame.features;
  input.previous = previous_;
  write("flow", draw_flow(frame, flow_.to_previous(input)));
  write("keypoints", draw_kept_keypoints(frame));
  write("depth", draw_blanked_depth(*frame.image, mover_pixels(frame, movable_classes_)));
}

void FigureRecorder::on_results(RunRecord& record) {
  if (frames_.empty()) return;
  for (const int frame : frames_) {
    if (previous_ && static_cast<std::size_t>(frame) <= previous_->index()) continue;
    warn(fmt::format("--figures: there is no frame {}", frame),
         previous_ ? fmt::format("the last one is {}", previous_->index()) : "");
  }
  draw_sparse(record);
}

void FigureRecorder::record_dropped(const Frame& frame) {
  Dropped dropped{frame.timestamp(), {}};
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    if (frame.evidence.weight[i] <= 0 && k.depth > 0)
      dropped.keypoints.push_back({k.u, k.v, k.depth});
  }
  dropped_.push_back(std::move(dropped));
}

void FigureRecorder::draw_sparse(const RunRecord& record) {
  if (!record.map) return;
  std::vector<Eigen::Vector3f> landmarks, dropped;
  for (const auto& landmark : record.map->map.landmarks)
    landmarks.push_back(landmark.p_world.cast<float>());
  const Trajectory& trajectory = record.result.trajectory;
  for (const Dropped& frame : dropped_) {
    const auto T_world_camera = pose_at(trajectory, frame.timestamp);
    if (!T_world_camera) continue;
    for (const Eigen::Vector3d& k : frame.keypoints) {
      const Eigen::Vector3d p_camera = record.result.camera.unproject(k.x(), k.y(), k.z());
      dropped.push_back((*T_world_camera * p_camera).cast<float>());
    }
  }
  folder_.write("figures/sparse_map.png", [&](const fs::path& file) {
    write_png(file, draw_sparse_map(landmarks, dropped, "keypoints of keyframes dropped as moving",
                                    trajectory));
  });
  std::vector<Eigen::Vector3f> repeated;
  for (const Eigen::Vector3d& p : record.result.refined.repeated)
    repeated.push_back(p.cast<float>());
  if (repeated.empty()) return;
  folder_.write("figures/repeated_landmarks.png", [&](const fs::path& file) {
    write_png(file,
              draw_sparse_map(landmarks, repeated, "landmarks erased as repeats", trajectory));
  });
}

}  // namespace stillmap
