// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/live_view.hpp"

#include "stillmap/base/warning.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace stillmap {
namespace {

// Number of frames that may wait to be shown; they hold no images, except for the first.
constexpr std::size_t kQueue = 256;
constexpr std::chrono::milliseconds kImagePeriod{100};  // shortest time between two images
constexpr std::chrono::milliseconds kMapPeriod{
    1000};  // shortest time between two states of the map
// A state of the map that took long to make is followed by a pause of this many times its duration.
constexpr int kMapPause = 9;
// The floor is searched again when the number of points has grown by this factor.
constexpr double kGroundGrowth = 1.25;

}  // namespace

LiveView::LiveView(SlamSystem& slam, ViewServer& server, const std::string& name,
                   const Camera& camera, std::optional<std::size_t> frames, GroundHints hints)
    : slam_(slam),
      server_(server),
      board_(server.board()),
      hints_(std::move(hints)),
      stage_(
          kQueue, WhenFull::kDrop,
          [this](const Task& task, const auto&) { guarded([&] { work(task); }); }, "view",
          ThreadPriority::kBackground) {
  board_.publish(run_message(name, camera, frames, Viewed::kRunInProgress));
}

void LiveView::on_frame(SlamSystem& slam) {
  const TrackedFramePtr& newest = slam.newest();
  const bool idle = stage_.waiting() == 0;
  stage_.push({slam.newest_record(), newest->T_world_filtered(), slam.load_shedding(),
               idle ? newest : nullptr});
}

void LiveView::guarded(const std::function<void()>& show) {
  if (failed_) return;
  try {
    show();
  } catch (const std::exception& e) {
    failed_ = true;
    warn(std::string("the view ends here: ") + e.what(),
         "the run goes on, and `stillmap view` shows its results; please report this");
  }
}

void LiveView::work(const Task& task) {
  states_.push_back({task.record.timestamp, viewed_state(task.record), {}});
  if (task.record.has_pose()) ++tracked_;
  const ViewTraffic traffic = server_.traffic();
  if (traffic.clients == 0) return;
  if (std::exchange(connected_, traffic.connected) != traffic.connected) next_map_ = Clock::now();
  show_frame(task);
  if (task.tracked && Clock::now() >= next_image_) show_image(*task.tracked);
  if (task.tracked && Clock::now() >= next_map_) show_map();
}

void LiveView::show_frame(const Task& task) {
  board_.publish(frame_message(task.record, task.T_world_camera, task.shedding, tracked_));
}

void LiveView::show_image(const TrackedFrame& tracked) {
  board_.publish("image", image_message(tracked), true);
  board_.publish(movers_message(slam_.ask_movers().get()));
  next_image_ = Clock::now() + kImagePeriod;
}

void LiveView::show_map() {
  const auto begin = Clock::now();
  const auto snapshot = slam_.snapshot();
  const auto labeled = slam_.ask_labeled_cloud().get();
  board_.publish("path", path_message(camera_path(states_, snapshot->trajectory)), true);
  if (std::exchange(cloud_, labeled) != labeled) {
    if (!labeled->classes.empty()) {
      board_.publish(palette_message(lasting_colors(labeled->classes)));
      board_.publish(objects_message(connected_objects(*labeled)));
    }
    MapCost cost = publish_changes(board_, chunks_, *labeled->cloud, labeled->labels);
    cost.milliseconds = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    board_.publish(cloud_message(labeled->cloud->size(), cost));
  }
  std::vector<Pose> keyframes;
  for (const KeyframePose& keyframe : snapshot->keyframes)
    keyframes.push_back(keyframe.T_world_camera);
  board_.publish(
      map_message(keyframes, snapshot->events, ground_of(snapshot->trajectory, *labeled->cloud)));
  const auto end = Clock::now();
  next_map_ = std::max(begin + kMapPeriod, end + kMapPause * (end - begin));
}

/// Returns the ground. A floor once found stays while none is found, and small changes are left
/// out: the picture would jump.
const Ground& LiveView::ground_of(const Trajectory& trajectory, const Cloud& cloud) {
  const auto points = static_cast<double>(cloud.size());
  if (ground_ && points < kGroundGrowth * static_cast<double>(ground_points_)) return *ground_;
  ground_points_ = cloud.size();
  const Ground ground = displayed_ground(trajectory, cloud, hints_);
  const bool worse =
      ground_ && ground_->source == UpSource::kFloor && ground.source == UpSource::kImages;
  if (!ground_ || (!worse && !look_alike(*ground_, ground))) ground_ = ground;
  return *ground_;
}

void LiveView::on_results(RunRecord& record) {
  stage_.drain();
  guarded([&] { publish_results(record.result); });
}

void LiveView::publish_results(const SlamResult& result) {
  board_.publish(tracks_message(result.movers));
  board_.publish("path", path_message(camera_path(states_, result.trajectory)), true);
  const SemanticMap& semantics = result.dense.semantics;
  const std::vector<ClassColor> classes = class_colors(semantics);
  board_.publish(palette_message(classes));
  board_.publish(objects_message(semantics.objects));
  const Cloud& cloud = result.dense.cloud;
  board_.publish(cloud_message(
      cloud.size(), publish_changes(board_, chunks_, cloud, class_labels(semantics, classes))));
  std::vector<Pose> keyframes;
  for (const StampedPose& keyframe : result.keyframes) keyframes.push_back(keyframe.T_world_camera);
  board_.publish(
      map_message(keyframes, result.events, displayed_ground(result.trajectory, cloud, hints_)));
  board_.publish({{"type", "finished"}});
}

}  // namespace stillmap
