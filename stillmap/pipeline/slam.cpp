// SPDX-License-Identifier: Apache-2.0
#include "stillmap/slam.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/journal_file.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/pipeline/frame_watch.hpp"
#include "stillmap/pipeline/map_changes.hpp"
#include "stillmap/pipeline/run_details.hpp"
#include "stillmap/pipeline/run_findings.hpp"
#include "stillmap/pipeline/run_journal.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/pipeline/snapshot.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/frame_check.hpp"
#include "stillmap/sensor/frame_maker.hpp"
#include "stillmap/sensor/halved.hpp"
#include "stillmap/sensor/require_image.hpp"
#include "stillmap/sensor/sample_buffer.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kWriter = "libstillmap";  // the writer that a saved map names

/// Returns the finding that more than a fifth of the pushed samples came too late.
std::optional<Finding> late_samples(const char* sensor, const LateSamples& samples) {
  constexpr std::size_t kShare = 5;
  if (kShare * samples.late <= samples.added) return std::nullopt;
  return make_finding(
      "late-samples",
      fmt::format("{} of {} samples of the {} came after the frame whose pose they should support, "
                  "up to {:.3f} s late",
                  samples.late, samples.added, sensor, samples.longest),
      "push samples before the first frame that is not earlier; give both the same clock",
      {{"late", static_cast<double>(samples.late)},
       {"samples", static_cast<double>(samples.added)},
       {"longest_s", samples.longest}});
}

/// Callbacks for one type of event. A subscription owns its callback and ends with it.
template <typename Event>
class Subscribers {
 public:
  using Call = std::function<void(const Event&)>;

  /// Throws Error for an empty function.
  Subscription add(Call call, const char* where) {
    if (!call) throw Error("the function is empty", where, "give a function to call");
    auto owned = std::make_shared<const Call>(std::move(call));
    calls_.push_back(owned);
    return owned;
  }

  /// Returns whether there are any subscriptions, after removing those that have ended.
  bool any() {
    std::erase_if(calls_, [](const auto& call) { return call.expired(); });
    return !calls_.empty();
  }

  void call(const Event& event) {
    const auto calls = calls_;  // a callback may subscribe another one
    for (const auto& subscribed : calls) {
      if (const auto call = subscribed.lock()) (*call)(event);
    }
  }

 private:
  std::vector<std::weak_ptr<const Call>> calls_;
};

/// Decides which of the pushed frames are used, as a source does for a recording.
class FrameSelection {
 public:
  explicit FrameSelection(const Options::Input& input) : input_(input) {}

  bool uses_next() const {
    const int after_first = pushed_ - input_.first;
    return after_first >= 0 && (input_.count == 0 || after_first < input_.count) &&
           after_first % input_.stride == 0;
  }
  void advance() { ++pushed_; }

 private:
  const Options::Input input_;
  int pushed_ = 0;  // number of frames pushed
};

/// The rules of Slam::watch().
struct WatchedRules {
  FrameWatch frames;
  WarningMonitor monitor;
};

/// Returns the classes that moving objects can have; none without a detector.
std::optional<std::vector<std::string>> classes_of(const Detector* detector) {
  if (detector == nullptr) return std::nullopt;
  return detector->class_names();
}

/// Returns the camera of the frames that are tracked.
Camera tracked_camera(const Camera& pushed, const Options& options) {
  return options.input.half_size ? halved(pushed) : pushed;
}

std::optional<StartingMap> starting_map(const std::optional<StartMap>& start,
                                        const MemoryLimit& memory) {
  if (!start) return std::nullopt;
  return StartingMap{read_saved_map(start->file, memory), start->extend};
}

PoseUpdate skipped(const RgbdFrame& frame) {
  PoseUpdate update;
  update.frame_index = frame.index;
  update.timestamp = frame.timestamp;
  update.state = PoseState::kSkipped;
  update.reason = "left out by the options of the input";
  return update;
}

Results results_of(const std::shared_ptr<const RunDetails>& details) {
  const SlamResult& result = details->result;
  Results results;
  results.trajectory = result.trajectory;
  results.poses = result.poses;
  results.keyframes = result.keyframes;
  results.cloud = std::shared_ptr<const Cloud>(details, &result.dense.cloud);
  results.movers = moving_object_tracks(result.movers);
  results.events = result.events;
  results.statistics = {.frames = result.frames.size(),
                        .tracked = result.tracked(),
                        .segmented = result.segmented,
                        .maps = result.maps,
                        .landmarks = result.landmarks,
                        .tracking_median_ms = quantile(result.timing.samples("tracking"), 0.5)};
  results.findings = details->findings;
  results.details = details;
  return results;
}

}  // namespace

struct Slam::Impl {
  Impl(const Camera& camera, const Options& chosen, const SlamParameters& parameters,
       std::unique_ptr<Detector> detector, const std::optional<StartMap>& start)
      : options(chosen),
        dense(parameters.dense),
        detector_description(detector ? detector->description() : ""),
        detector_gives_boxes_only(detector && !detector->gives_masks()),
        detected_classes(classes_of(detector.get())),
        frames(camera),
        rectifies(camera.distorted() || !camera.ignore.empty()),
        selection(chosen.input),
        check(tracked_camera(frames.camera(), chosen)),
        system(tracked_camera(frames.camera(), chosen), parameters, std::move(detector),
               starting_map(start, parameters.dense.memory)) {}

  RgbdFramePtr made(RgbdFramePtr frame);
  void require_pushable(const RgbdFramePtr& frame);
  PoseUpdate track(const RgbdFramePtr& frame);
  void notify(const PoseUpdate& update);
  void notify_keyframes(const MapView& view);

  const Stopwatch watch;
  const Options options;
  const DenseOptions dense;
  const std::string detector_description;
  const bool detector_gives_boxes_only;
  const std::optional<std::vector<std::string>> detected_classes;
  FrameMaker frames;
  const bool rectifies;  // whether the images are distorted or have ignored pixels
  std::vector<std::weak_ptr<const RgbdFrame>> rectified;  // frames made but not pushed yet
  FrameSelection selection;
  SampleBuffer<ImuSample> imu;
  SampleBuffer<OdometrySample> odometry;
  FrameCheck check;
  std::size_t next_index = 0;
  Subscribers<PoseUpdate> pose;
  Subscribers<KeyframePose> keyframe;
  Subscribers<MapCorrection> correction;
  Subscribers<std::vector<MovingObject>> movers;
  Subscribers<WarningEvent> warning;
  std::optional<WatchedRules> watched;
  SlamSystem system;
  std::optional<RunJournal> journal;  // none: the results so far are not kept in a file
  std::atomic<bool> finished = false;

  std::vector<Finding> findings() const;
  /// Throws Error if the run has ended.
  void require_running(const char* where) const {
    if (finished) throw Error("the run has ended with finish()", where, "make another Slam");
  }
};

std::vector<Finding> Slam::Impl::findings() const {
  std::vector<Finding> all = check.findings();
  if (auto late = late_samples("IMU", imu.late())) all.push_back(std::move(*late));
  if (auto late = late_samples("wheels", odometry.late())) all.push_back(std::move(*late));
  return all;
}

/// Counts a frame, and remembers that it is rectified.
RgbdFramePtr Slam::Impl::made(RgbdFramePtr frame) {
  ++next_index;
  if (rectifies) {
    std::erase_if(rectified, [](const auto& other) { return other.expired(); });
    rectified.push_back(frame);
  }
  return frame;
}

/// Throws Error for a frame that is null, not of the camera's size, or not rectified.
void Slam::Impl::require_pushable(const RgbdFramePtr& frame) {
  constexpr const char* kWhere = "Slam::push";
  if (!frame) throw Error("the frame is null", kWhere, "push frames only");
  require_size(frame->color, frames.camera(), "color image", kWhere);
  require_size(frame->gray, frames.camera(), "gray image", kWhere);
  require_size(frame->depth, frames.camera(), "depth image", kWhere);
  if (!rectifies) return;
  const auto made = std::find_if(rectified.begin(), rectified.end(),
                                 [&](const auto& other) { return other.lock() == frame; });
  if (made != rectified.end()) return;
  throw Error(fmt::format("camera '{}' is distorted or has ignored pixels, and make_frame() did "
                          "not make this frame",
                          frames.camera().name),
              kWhere,
              "push the images, or the frame that make_frame() makes of them; for the rectified "
              "frames of a FrameSource, construct Slam with its camera()");
}

PoseUpdate Slam::Impl::track(const RgbdFramePtr& frame) {
  auto tracked = std::make_shared<RgbdFrame>(options.input.half_size ? halved(*frame) : *frame);
  if (tracked->imu.empty()) tracked->imu = imu.take_until(frame->timestamp);
  if (tracked->odometry.empty()) tracked->odometry = odometry.take_until(frame->timestamp);
  system.push(tracked);
  check.add(*tracked);
  return pose_update(*system.newest(), system.view());
}

/// Calls the subscribers of all events of the frame pushed last.
void Slam::Impl::notify(const PoseUpdate& update) {
  const TrackedFrame& newest = *system.newest();
  const MapView& view = system.view();
  if (pose.any()) pose.call(update);
  if (keyframe.any()) notify_keyframes(view);
  // A relocalization result that the tracker did not accept only adds another component to the
  // view.
  const bool moved = view.moved && (!view.found || newest.relocalized);
  if (moved && correction.any())
    correction.call({newest.frame->index(), newest.frame->timestamp()});
  if (movers.any()) movers.call(moving_objects(system.movers()));
  if (!watched) return;
  for (const WarningEvent& event : watched->monitor.update(watched->frames.newest(system))) {
    if (warning.any()) warning.call(event);
  }
}

void Slam::Impl::notify_keyframes(const MapView& view) {
  for (const NewKeyframe& made : view.made) {
    const LocalKeyframe* k = view.local_map ? view.local_map->find(made.id) : nullptr;
    if (k != nullptr) keyframe.call({made.frame_index, made.timestamp, k->T_world_camera});
  }
}

Slam::Slam(const Camera& camera, const Options& options, std::unique_ptr<Detector> detector,
           const std::optional<StartMap>& start) {
  const SlamParameters parameters = parameters_of(options);
  if (!detector) detector = make_detector(parameters.segment);
  check_classes(options, detector.get());
  impl_ = std::make_unique<Impl>(camera, options, parameters, std::move(detector), start);
}

Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

void Slam::keep_journal(const std::filesystem::path& file) {
  constexpr const char* kWhere = "Slam::keep_journal";
  impl_->require_running(kWhere);
  if (impl_->journal) throw Error("the run has a journal", kWhere, "call it once");
  if (is_journal(file)) {
    throw Error("holds the journal of another run", file.string(),
                "write its results with `stillmap recover`, or remove it");
  }
  const JournalHeading heading{kWriter, file.parent_path().filename().string(),
                               machine_description(), options_yaml(impl_->options)};
  impl_->journal.emplace(impl_->system, file, heading);
}

RgbdFramePtr Slam::make_frame(const cv::Mat& color, const cv::Mat& depth, double timestamp) {
  return impl_->made(impl_->frames.make(color, depth, timestamp, impl_->next_index));
}

RgbdFramePtr Slam::make_stereo_frame(const cv::Mat& left, const cv::Mat& right, double timestamp) {
  return impl_->made(impl_->frames.make_of_pair(left, right, timestamp, impl_->next_index));
}

PoseUpdate Slam::push(const RgbdFramePtr& frame) {
  impl_->require_running("Slam::push");
  impl_->require_pushable(frame);
  const bool used = impl_->selection.uses_next();
  const PoseUpdate update = used ? impl_->track(frame) : skipped(*frame);
  impl_->selection.advance();
  impl_->next_index = std::max(impl_->next_index, frame->index + 1);
  if (used && impl_->journal) impl_->journal->add_newest();
  if (used) impl_->notify(update);
  return update;
}

void Slam::push_imu(const ImuSample& sample) {
  constexpr const char* kWhere = "Slam::push_imu";
  impl_->require_running(kWhere);
  const std::optional<Imu>& imu = impl_->frames.camera().imu;
  if (!imu) {
    throw Error(fmt::format("camera '{}' has no IMU", impl_->frames.camera().name), kWhere,
                "set Camera::imu, or the keys imu and T_camera_imu of the camera file");
  }
  if (!std::isfinite(sample.timestamp) || !sample.angular_velocity.allFinite() ||
      !sample.acceleration.allFinite())
    throw Error("a number of the sample is not finite", kWhere, "leave such samples out");
  ImuSample by_images = sample;
  by_images.timestamp -= imu->time_offset;
  impl_->imu.add(by_images);
}

void Slam::push_odometry(const OdometrySample& sample) {
  constexpr const char* kWhere = "Slam::push_odometry";
  impl_->require_running(kWhere);
  const Camera& camera = impl_->frames.camera();
  if (!camera.wheels) {
    throw Error(fmt::format("camera '{}' is on no wheels", camera.name), kWhere,
                "set Camera::wheels, or the key T_camera_base of the camera file");
  }
  if (!std::isfinite(sample.timestamp) || !sample.T_odom_base.translation().allFinite() ||
      !sample.T_odom_base.quaternion().coeffs().allFinite())
    throw Error("a number of the sample is not finite", kWhere, "leave such samples out");
  impl_->odometry.add(sample);
}

PoseUpdate Slam::push(const cv::Mat& color, const cv::Mat& depth, double timestamp) {
  return push(make_frame(color, depth, timestamp));
}

std::string Slam::load_map(const std::filesystem::path& file) {
  impl_->require_running("Slam::load_map");
  const SlamParameters parameters = parameters_of(impl_->options);
  return impl_->system.load(read_saved_map(file, parameters.dense.memory));
}

void Slam::set_mode(Mode mode) {
  impl_->require_running("Slam::set_mode");
  impl_->system.set_extend(mode == Mode::kMap);
}

void Slam::watch(const std::filesystem::path& file) {
  impl_->require_running("Slam::watch");
  const WarningRules rules = read_warning_rules(file);
  check_rule_classes(rules, impl_->detected_classes, file.string());
  const bool has_network = impl_->detected_classes.has_value();
  impl_->watched.emplace(WatchedRules{{rules.zones, has_network}, WarningMonitor(rules)});
}

std::vector<WarningEvent> Slam::warnings() const {
  if (!impl_->watched) return {};
  return impl_->watched->monitor.active();
}

std::vector<Finding> Slam::findings() const { return impl_->findings(); }

std::optional<ObservedFrame> Slam::newest() const {
  if (!impl_->system.newest()) return std::nullopt;
  return observed_frame(*impl_->system.newest(), impl_->system.view());
}

std::shared_ptr<const Snapshot> Slam::snapshot() const { return impl_->system.snapshot(); }

std::vector<MovingObject> Slam::movers() const {
  return moving_objects(impl_->system.ask_movers().get());
}

std::vector<ObjectChange> Slam::changes() const {
  impl_->require_running("Slam::changes");
  return object_changes(newest_changes(impl_->system.saved_map(kWriter), impl_->dense));
}

Subscription Slam::on_pose(std::function<void(const PoseUpdate&)> call) {
  return impl_->pose.add(std::move(call), "Slam::on_pose");
}

Subscription Slam::on_keyframe(std::function<void(const KeyframePose&)> call) {
  return impl_->keyframe.add(std::move(call), "Slam::on_keyframe");
}

Subscription Slam::on_map_changed(std::function<void(const MapCorrection&)> call) {
  return impl_->correction.add(std::move(call), "Slam::on_map_changed");
}

Subscription Slam::on_warning(std::function<void(const WarningEvent&)> call) {
  return impl_->warning.add(std::move(call), "Slam::on_warning");
}

Subscription Slam::on_movers(std::function<void(const std::vector<MovingObject>&)> call) {
  return impl_->movers.add(std::move(call), "Slam::on_movers");
}

Results Slam::finish() {
  impl_->require_running("Slam::finish");
  impl_->finished = true;
  if (impl_->journal) impl_->journal->flush();
  impl_->journal.reset();
  const auto details = std::make_shared<RunDetails>();
  details->result = impl_->system.finish();
  details->options = impl_->options;
  details->detector = impl_->detector_description;
  details->detector_gives_boxes_only = impl_->detector_gives_boxes_only;
  details->frames = details->result.frames.size();
  if (impl_->options.dense.enabled) details->map = impl_->system.saved_map(kWriter);
  details->seconds = impl_->watch.milliseconds() / 1000;
  details->findings = impl_->findings();
  append(run_findings(*details), details->findings);
  Results results = results_of(details);
  impl_->system.show(results.cloud);
  if (impl_->keyframe.any()) impl_->notify_keyframes(impl_->system.view());
  if (impl_->system.newest() && impl_->correction.any()) {
    const Frame& newest = *impl_->system.newest()->frame;
    impl_->correction.call({newest.index(), newest.timestamp()});
  }
  return results;
}

void Slam::save_map(const std::filesystem::path& file) const {
  write_saved_map(file, impl_->system.saved_map(kWriter));
}

}  // namespace stillmap
