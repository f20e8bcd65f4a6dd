// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/dense_stream.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/segment/box_cluster.hpp"
#include "stillmap/segment/dynamic_mask.hpp"
#include "stillmap/track/global_shutter.hpp"

#include <algorithm>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// Length of the queue of frames; in realtime it is long enough for all views to be integrated again
// while the camera goes on.
constexpr std::size_t kQueue = 8, kRealtimeQueue = 24;
// In realtime a frame that is not a keyframe is only added if at most kBusy frames wait, and
// kReserve places of the queue are kept free, so that the camera never waits for the dense map.
constexpr std::size_t kBusy = 2, kReserve = 4;
// Interval of the frames whose depths are averaged.
constexpr std::size_t kFuseEvery = 2;

/// Returns the newest detections of static objects, in the pixels of `image`; none if they are more
/// than `max_age` frames old.
SegmentedFrame objects_in(const DetectedObjects& found, const RgbdFrame& image,
                          const std::vector<std::string>& movers, std::size_t max_age) {
  SegmentedFrame objects{.frame_index = image.index, .source_index = image.index, .instances = {}};
  if (!found.image || found.image->index > image.index ||
      image.index - found.image->index > max_age) {
    return objects;
  }
  for (Instance instance : found.instances->instances) {
    if (std::find(movers.begin(), movers.end(), instance.class_name) != movers.end()) continue;
    if (instance.mask.empty()) instance.mask = cluster_in_box(found.image->depth, instance.box);
    objects.instances.push_back(std::move(instance));
  }
  if (objects.instances.empty()) return objects;
  objects.frame_index = objects.source_index = found.image->index;
  if (found.image->index == image.index) return trim_by_depth(objects, image);
  return propagate_masks(objects, *found.image, image);
}

/// Returns instances of the recorded image in the pixels of the shutter's images.
SegmentedFrame moved(SegmentedFrame objects, const GlobalShutter& shutter, cv::Size size) {
  if (!shutter.has_effect()) return objects;
  for (Instance& instance : objects.instances) {
    cv::Mat1b image = cv::Mat1b::zeros(size);
    instance.mask.copyTo(image(instance.box));
    image = shutter.mask(image);
    instance.box = cv::boundingRect(image);
    instance.mask = image(instance.box).clone();
  }
  std::erase_if(objects.instances, [](const Instance& object) { return object.box.empty(); });
  return objects;
}

}  // namespace

cv::Mat1b mover_pixels(const Frame& frame, const std::vector<std::string>& classes) {
  cv::Mat1b movers = frame.evidence.moving_pixels;
  if (!frame.instances || frame.instances->instances.empty() || classes.empty()) return movers;
  cv::Mat1b masks = dynamic_mask(*frame.instances, classes, frame.image->gray.size());
  if (movers.empty()) return masks;
  return movers | masks;
}

DenseStream::DenseStream(const Camera& camera, const SlamParameters& options, bool extend,
                         std::vector<AnchoredView> loaded)
    : camera_(camera),
      max_mask_age_(static_cast<std::size_t>(options.schedule.max_mask_age)),
      every_(static_cast<std::size_t>(options.dense.every)),
      realtime_(options.schedule.realtime),
      extend_(extend),
      fuse_(options.dense.fuse),
      dense_(camera, options.dense) {
  if (!options.dense_cloud) return;
  loaded_views_ = loaded.size();
  add_loaded(std::move(loaded));
  stage_ = std::make_unique<Stage<Task, Nothing>>(
      realtime_ ? kRealtimeQueue : kQueue, WhenFull::kBlock,
      [this](const Task& task, const auto&) { work(task); }, "dense map",
      ThreadPriority::kBackground);
}

void DenseStream::add(std::vector<AnchoredView> loaded) {
  if (!stage_) return;
  loaded_views_ += loaded.size();
  Task task;
  task.loaded = std::make_shared<std::vector<AnchoredView>>(std::move(loaded));
  stage_->push(std::move(task));
}

void DenseStream::push(const TrackedFramePtr& tracked, const DetectedObjects& found,
                       const MapView& map) {
  if (!stage_) return;
  made_.insert(made_.end(), map.made.begin(), map.made.end());
  Task task;
  // The moved poses may be those around a relocalization result. If the tracker did not accept it,
  // its world is another one.
  if (!map.found || tracked->relocalized) task.moved = map.moved;
  if (!extend_) task.moved = poses_to_place(tracked->enters_world(), std::move(task.moved));
  if (wants(*tracked)) {
    task.tracked = tracked;
    task.found = found;
    task.may_become_view = is_due(*tracked);
    if (task.may_become_view) {
      last_frame_ = tracked->frame->index();
      ++pushed_views_;
    }
  }
  if (!task.tracked && !task.moved) return;
  task.made = std::exchange(made_, {});
  task.enters_world = tracked->enters_world();
  stage_->push(std::move(task));
}

/// Returns the keyframe poses of a map that is not extended; null once all its views are in the
/// live map.
std::shared_ptr<const KeyframePoses> DenseStream::poses_to_place(
    bool localized, std::shared_ptr<const KeyframePoses> moved) {
  if (localized && moved) {
    localized_ = std::move(moved);
    frames_to_place_ = loaded_views_ + pushed_views_;
    return localized_;
  }
  if (moved) return moved;
  const bool busy = realtime_ && stage_->waiting() > kBusy;
  if (frames_to_place_ == 0 || busy) return nullptr;
  --frames_to_place_;
  return localized_;
}

/// Returns whether a frame may become a view.
bool DenseStream::is_due(const TrackedFrame& tracked) const {
  if (tracked.proposal || tracked.enters_world()) return true;
  return every_ > 0 && tracked.frame->index() >= last_frame_ + every_;
}

bool DenseStream::wants(const TrackedFrame& tracked) {
  if (!tracked.has_pose() || !extend_) return false;
  if (tracked.enters_world()) return true;
  const std::size_t waiting = realtime_ ? stage_->waiting() : 0;
  const bool fused = fuse_ && tracked.frame->index() % kFuseEvery == 0;
  if (!tracked.proposal && ((!fused && !is_due(tracked)) || waiting > kBusy)) return false;
  if (waiting + kReserve <= kRealtimeQueue) return true;
  ++frames_left_out_;
  return false;
}

void DenseStream::add_loaded(std::vector<AnchoredView> views) {
  for (AnchoredView& view : views) {
    places_[next_loaded_] = {view.anchor, view.T_anchor_camera};
    dense_.add(next_loaded_++, std::move(view.view));
  }
}

void DenseStream::work(const Task& task) {
  if (task.loaded) return add_loaded(std::move(*task.loaded));
  settle(task.made);
  cloud_.reset();
  if (task.tracked) trace_frame(task.tracked->frame->index());
  if (task.enters_world) dense_.start_new_world();
  if (task.moved) follow(*task.moved);
  if (task.tracked) add(task);
}

void DenseStream::add(const Task& task) {
  const TrackedFrame& tracked = *task.tracked;
  const RgbdFrame& recorded = *tracked.frame->image;
  const std::vector<std::string>& classes = dense_.options().movers;
  SegmentedFrame objects;
  if (task.may_become_view) {
    objects = traced(span::kDenseLabels,
                     [&] { return objects_in(task.found, recorded, classes, max_mask_age_); });
  }
  const TraceScope scope(tracked.proposal ? span::kDenseKeyframe : span::kDenseOtherFrame);
  const GlobalShutter shutter(recorded, camera_, tracked.frame->exposure);
  const RgbdFrame image = shutter.frame();
  const cv::Mat1b movers =
      traced("mover pixels", [&] { return shutter.mask(mover_pixels(*tracked.frame, classes)); });
  if (fuse_) dense_.fuse(image, movers, *tracked.T_world_camera);
  if (!task.may_become_view) return;
  objects = moved(std::move(objects), shutter, recorded.depth.size());
  const std::uint64_t view = view_of(tracked.frame->index());
  if (tracked.proposal) {
    dense_.add(view, image, movers, tracked.T_world_camera, &objects);
  } else if (!dense_.add_if_new(view, image, movers, *tracked.T_world_camera, &objects)) {
    return;
  }
  places_[view] = {tracked.reference, tracked.T_reference_camera};
}

/// The view of a frame that became a keyframe has the pose of that keyframe.
void DenseStream::settle(const std::vector<NewKeyframe>& made) {
  for (const NewKeyframe& keyframe : made) {
    const auto view = places_.find(view_of(keyframe.frame_index));
    if (view != places_.end()) view->second = {keyframe.id, Pose()};
  }
}

void DenseStream::follow(const KeyframePoses& moved) {
  const TraceScope scope(span::kDenseCorrected);
  dense_.update_poses([&](std::uint64_t view) -> std::optional<Pose> {
    const RelativePlace& place = places_.at(view);
    const auto found = moved.find(place.keyframe);
    if (found == moved.end()) return std::nullopt;
    return found->second * place.T_keyframe_camera;
  });
}

void DenseStream::wait() {
  if (stage_) stage_->drain();
}

void DenseStream::finish(const std::vector<NewKeyframe>& made) {
  wait();
  dense_.close_view();
  settle(std::exchange(made_, {}));
  settle(made);
}

std::future<std::shared_ptr<const LabeledCloud>> DenseStream::ask() {
  if (!stage_) {
    const auto empty = [] { return std::make_shared<const LabeledCloud>(); };
    return std::async(std::launch::deferred, empty);
  }
  return stage_->ask([this] {
    const TraceBinding untraced(nullptr);  // the query is not work on a frame
    return live_cloud();
  });
}

std::future<void> DenseStream::ask(std::function<void(const DenseStream&)> read) {
  auto ask = [this, read = std::move(read)] {
    const TraceBinding untraced(nullptr);  // the query is not work on a frame
    read(*this);
  };
  return stage_ ? stage_->ask(std::move(ask)) : std::async(std::launch::deferred, std::move(ask));
}

void DenseStream::show(std::shared_ptr<const Cloud> cloud) {
  LabeledCloud shown;
  shown.cloud = std::move(cloud);
  const auto shared = std::make_shared<const LabeledCloud>(std::move(shown));
  if (stage_) stage_->ask([&] { cloud_ = shared; }).get();
}

std::shared_ptr<const LabeledCloud> DenseStream::live_cloud() {
  if (cloud_) return cloud_;
  const LiveMap& live = dense_.live();
  const StaticGrid& grid = live.grid();
  auto cloud = std::make_shared<Cloud>();
  LabeledCloud labeled;
  for (std::uint32_t cell = 0; cell < grid.index().size(); ++cell) {
    if (!grid.is_static(cell) || !grid.is_confirmed(cell)) continue;
    cloud->add(grid.mean(cell), grid.color(cell));
    labeled.voxels.push_back(grid.index().voxel(cell));
    if (!live.classes().empty()) labeled.labels.push_back(live.class_of(cell));
  }
  labeled.cloud = std::move(cloud);
  labeled.classes = live.classes();
  cloud_ = std::make_shared<const LabeledCloud>(std::move(labeled));
  return cloud_;
}

std::map<std::uint32_t, ViewPoses> DenseStream::poses_by_component(const Map& map) const {
  std::map<std::uint32_t, ViewPoses> by_component;
  for (const auto& [id, view] : dense_.views()) {
    const auto place = current_place(map, places_.at(id));
    if (!place) continue;
    const Keyframe& keyframe = map.at(place->keyframe);
    by_component[keyframe.component][id] = keyframe.T_world_camera * place->T_keyframe_camera;
  }
  return by_component;
}

PlacedMap DenseStream::place(const Map& map, const std::map<std::uint32_t, int>& frames) {
  // The live map is no longer needed; until show() ask() returns the cached cloud or an empty one.
  if (stage_) stage_->ask([this] { dense_.start_new_world(); }).get();
  for (const auto& [component, poses] : poses_by_component(map))
    dense_.replace_seen_again(view_of(0), pose_lookup(poses));
  const auto by_component = poses_by_component(map);
  const auto most = std::ranges::max_element(frames, {}, [](const auto& of) { return of.second; });
  const auto poses = most == frames.end() ? by_component.end() : by_component.find(most->first);
  return dense_.place(
      pose_lookup(poses == by_component.end() ? largest_of(by_component) : poses->second));
}

std::vector<AnchoredView> DenseStream::saved_views(const Map& map) const {
  const auto position = positions_in_content(map);
  std::vector<AnchoredView> views;
  for (const auto& [id, view] : dense_.views()) {
    const auto place = current_place(map, places_.at(id));
    if (!place) continue;
    views.push_back({{position.at(place->keyframe), 0}, place->T_keyframe_camera, *view});
  }
  number_present_visit(views);
  return views;
}

}  // namespace stillmap
