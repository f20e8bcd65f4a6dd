// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/late_tracking.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/keypoint_depths.hpp"
#include "stillmap/feature/paged_features.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/track/local_map_tracking.hpp"
#include "stillmap/track/moving_majority.hpp"
#include "stillmap/track/reference_keyframe_tracking.hpp"
#include "stillmap/track/start_verification.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <ranges>
#include <utility>
#include <vector>

namespace stillmap {
namespace {

/// Maximum number of frames that are kept, of some 60 kB each.
constexpr std::size_t kMaxFrames = 20000;
/// Longest time between a frame and the pose that it is tracked from [s].
constexpr double kMaxTime = 0.5;

/// Expected pose of a frame.
struct Guess {
  Pose T_world_camera;
  KeyframeId reference;  ///< Keyframe of the nearest frame with a pose.
};

/// A frame with a pose near another one.
struct Neighbor {
  double seconds = 0;  ///< Time between the two frames, not negative [s].
  Guess at;
};

/// Returns the nearest frame with a pose before (step -1) or after (step +1) a record.
std::optional<Neighbor> neighbor(const Map& map, const std::vector<FrameRecord>& records,
                                 std::ptrdiff_t record, std::ptrdiff_t step) {
  const double timestamp = records[static_cast<std::size_t>(record)].timestamp;
  for (std::ptrdiff_t i = record + step; i >= 0 && i < std::ssize(records); i += step) {
    const FrameRecord& r = records[static_cast<std::size_t>(i)];
    const double seconds = std::abs(r.timestamp - timestamp);
    if (seconds > kMaxTime) return std::nullopt;
    if (const auto pose = pose_in(map, r)) return Neighbor{seconds, {*pose, r.reference}};
  }
  return std::nullopt;
}

std::optional<Guess> guess_of(const Map& map, const std::vector<FrameRecord>& records,
                              std::ptrdiff_t record) {
  const auto before = neighbor(map, records, record, -1);
  const auto after = neighbor(map, records, record, +1);
  if (!before && !after) return std::nullopt;
  if (!before) return after->at;
  if (!after) return before->at;
  const double share = before->seconds / (before->seconds + after->seconds);
  return Guess{interpolate(before->at.T_world_camera, after->at.T_world_camera, share),
               share < 0.5 ? before->at.reference : after->at.reference};
}

/// Pose of a frame in the map.
struct Found {
  KeyframeId reference;
  Pose T_reference_camera;
  PoseEstimate estimate;
};

/// The local maps around keyframes of a map that rests, each made once for consecutive frames.
class LocalMaps {
 public:
  explicit LocalMaps(const Map& map) : map_(map) {}
  const Map& map() const { return map_; }
  LocalMapPtr around(KeyframeId reference) {
    if (made_.size() > kKept) made_.clear();
    LocalMapPtr& local = made_[map_.current_keyframe(reference)];
    if (!local) local = make_local_map(map_, map_.current_keyframe(reference));
    return local;
  }

 private:
  static constexpr std::size_t kKept = 8;
  const Map& map_;
  std::map<KeyframeId, LocalMapPtr> made_;
};

/// Returns the pose of a frame, searched around a guess or else from the reference keyframe alone.
std::optional<Found> pose_near(const TrackingModel& model, LocalMaps& maps, const Frame& frame,
                               const Guess& guess, int min_inliers) {
  const LocalMapPtr local_map = maps.around(guess.reference);
  auto pose =
      refine_in_local_map(model, *local_map, frame, {guess.T_world_camera, {}}, min_inliers);
  if (!pose) {
    const auto first = track_reference_keyframe(model, *local_map, guess.T_world_camera, frame);
    if (first) pose = refine_in_local_map(model, *local_map, frame, *first, min_inliers);
  }
  if (!pose) return std::nullopt;
  const Pose T_reference_world = local_map->keyframes.front().T_world_camera.inverse();
  return Found{local_map->reference, T_reference_world * pose->estimate.T_world_camera,
               std::move(pose->estimate)};
}

/// Returns the pose of a frame from its own pose in the map or, unless that is reliable, from the
/// poses of its neighbors in the log: the one that more landmarks agree with.
/// @param frame  with the depths of the map
std::optional<Found> pose_again(const TrackingModel& model, LocalMaps& maps, int min_inliers,
                                const KeptFrame& kept, const Frame& frame,
                                const std::vector<FrameRecord>& records, std::size_t position) {
  // A reliable pose is replaced if more landmarks agree, or at least this share of their number and
  // the new pose is more certain or of depths with a smaller error. Poses by the IMU are more
  // certain, but have errors in common with their neighbors, which smoothing does not reduce.
  constexpr double kLeastShare = 0.5;
  const FrameRecord& record = records[position];
  const auto agreeing = [](const std::optional<Found>& found) {
    return found ? std::ssize(found->estimate.matches) : 0;
  };
  const auto variance = [](const Matrix6d& covariance) {  // of the position [m^2]
    return covariance.topLeftCorner<3, 3>().trace();
  };
  std::optional<Found> found;
  const auto known = pose_in(maps.map(), record);
  if (known) found = pose_near(model, maps, frame, {*known, record.reference}, min_inliers);
  if (known && kept.reliable) {
    const bool more = agreeing(found) >= record.inliers;
    const bool half = static_cast<double>(agreeing(found)) >= kLeastShare * record.inliers;
    const bool better =
        kept.with_imu || frame.depth_error != maps.map().depth_error() ||
        (found && variance(found->estimate.covariance) < variance(record.covariance));
    return more || (half && better) ? std::move(found) : std::nullopt;
  }
  const auto guess = guess_of(maps.map(), records, static_cast<std::ptrdiff_t>(position));
  auto other = guess ? pose_near(model, maps, frame, *guess, min_inliers) : std::nullopt;
  return agreeing(other) > agreeing(found) ? std::move(other) : std::move(found);
}

/// Tracks a frame and places it in the log. Returns whether it has a pose now.
/// @param kept  with the depths of the time when it was recorded
bool track_one(const TrackingModel& model, LocalMaps& maps, int min_inliers, const KeptFrame& kept,
               FrameLog& log) {
  const Map& map = maps.map();
  const Frame& recorded = *kept.frame;
  const std::size_t position = log.position(recorded.index());
  const FrameRecord& record = log.records()[position];
  const bool known = pose_in(map, record).has_value();
  if (known && record.state == TrackState::kStarted) return true;  // it is the map's reference
  Frame frame = recorded;
  frame.features =
      without_depth_error(recorded.features, map.depth_error(), recorded.depth_error, map.camera());
  const auto found = pose_again(model, maps, min_inliers, kept, frame, log.records(), position);
  if (found) log.place(frame.index(), found->reference, found->T_reference_camera, found->estimate);
  return known || found;
}

/// Returns whether the pose of a frame is to be relied on.
bool is_reliable(const TrackedFrame& tracked, int since_start) {
  return tracked.has_pose() && !tracked.contradicts_motion &&
         since_start > StartVerification::kFrames &&
         moving_share(tracked.frame->evidence.weight) <= kMovingMajority;
}

}  // namespace

void LateTracking::add(const TrackedFrame& tracked) {
  since_start_ = tracked.state == TrackState::kStarted ? 0 : since_start_ + 1;
  // The keypoints of the first frame of a map that was started again are not compensated.
  if (tracked.earlier && !frames_.empty() &&
      frames_.back().frame->index() == tracked.earlier->frame_index)
    drop_newest();
  if (tracked.confirmed) return;
  const bool reliable = is_reliable(tracked, since_start_);
  auto image = std::make_shared<RgbdFrame>();
  image->index = tracked.frame->image->index;
  image->timestamp = tracked.frame->image->timestamp;
  auto frame = std::make_shared<Frame>();
  frame->image = std::move(image);
  frame->features = tracked.frame->features;
  frame->depth_error = tracked.frame->depth_error;
  // Measurements that were derived from the poses of a wrong map are wrong, too.
  frame->evidence.weight = tracked.has_pose() && !reliable
                               ? evidence_of_classes(*tracked.frame).weight
                               : tracked.frame->evidence.weight;
  bytes_in_memory_ += frame->features->bytes();
  frames_.push_back({std::move(frame), reliable, imu_ && !tracked.frame->image->imu.empty()});
  move_to_file();
  if (frames_.size() <= kMaxFrames) return;
  if (in_file_ > 0)
    --in_file_;
  else
    bytes_in_memory_ -= frames_.front().frame->features->bytes();
  frames_.pop_front();
}

void LateTracking::drop_newest() {
  if (in_file_ == frames_.size())
    --in_file_;
  else
    bytes_in_memory_ -= frames_.back().frame->features->bytes();
  frames_.pop_back();
}

/// Moves the keypoints of the oldest frames to the file until the others fit the memory.
void LateTracking::move_to_file() {
  while (bytes_in_memory_ > file_.limit() && in_file_ < frames_.size()) {
    KeptFrame& oldest = frames_[in_file_];
    PagedFeatures stored = paged(*oldest.frame->features, file_);
    if (!stored.features) return;
    bytes_in_memory_ -= oldest.frame->features->bytes();
    auto frame = std::make_shared<Frame>(*oldest.frame);
    frame->features = std::move(stored.features);
    oldest.frame = std::move(frame);
    oldest.pages = std::move(stored.pages);
    oldest.pages->drop();
    ++in_file_;
  }
}

void LateTracking::track_again(const TrackingModel& model, const Map& map, int min_inliers,
                               FrameLog& log) const {
  const TraceScope scope("late tracking");
  LocalMaps maps(map);
  const auto track = [&](const KeptFrame& kept) {
    const bool placed = track_one(model, maps, min_inliers, kept, log);
    if (kept.pages) kept.pages->drop();
    return placed;
  };
  // From the frames after each gap, then from those before it.
  std::vector<const KeptFrame*> left;
  for (const KeptFrame& kept : frames_ | std::views::reverse) {
    if (!track(kept)) left.push_back(&kept);
  }
  for (const KeptFrame* kept : left | std::views::reverse) track(*kept);
}

}  // namespace stillmap
