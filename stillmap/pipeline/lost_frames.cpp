// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/lost_frames.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/track/local_map_tracking.hpp"
#include "stillmap/track/moving_majority.hpp"
#include "stillmap/track/reference_keyframe_tracking.hpp"
#include "stillmap/track/start_verification.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

namespace stillmap {
namespace {

/// Maximum number of frames that are kept, of some 100 KiB each.
constexpr std::size_t kMaxFrames = 300;
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

/// Tracks a frame from its neighbors in the log. Returns whether it has a pose now.
bool track_one(const TrackingModel& model, LocalMaps& maps, int min_inliers, const Frame& frame,
               FrameLog& log) {
  const Map& map = maps.map();
  const std::size_t position = log.position(frame.index());
  const FrameRecord& record = log.records()[position];
  const auto known = pose_in(map, record);
  if (known && record.state == TrackState::kStarted) return true;  // it is the map's reference
  const auto guess = guess_of(map, log.records(), static_cast<std::ptrdiff_t>(position));
  if (!guess) return known.has_value();
  const auto found = pose_near(model, maps, frame, *guess, min_inliers);
  if (!found) return known.has_value();
  if (known) {
    const auto again = pose_near(model, maps, frame, {*known, record.reference}, min_inliers);
    if (again && again->estimate.matches.size() >= found->estimate.matches.size()) return true;
  }
  log.place(frame.index(), found->reference, found->T_reference_camera, found->estimate);
  return true;
}

/// Returns whether the pose of a frame with one is not to be relied on.
bool is_doubtful(const TrackedFrame& tracked, int since_start) {
  return tracked.contradicts_motion || since_start <= StartVerification::kFrames ||
         moving_share(tracked.frame->evidence.weight) > kMovingMajority;
}

}  // namespace

void LostFrames::add(const TrackedFrame& tracked) {
  since_start_ = tracked.state == TrackState::kStarted ? 0 : since_start_ + 1;
  if (tracked.has_pose() && !is_doubtful(tracked, since_start_)) return;
  auto image = std::make_shared<RgbdFrame>();
  image->index = tracked.frame->image->index;
  image->timestamp = tracked.frame->image->timestamp;
  auto frame = std::make_shared<Frame>();
  frame->image = std::move(image);
  frame->features = tracked.frame->features;
  // Measurements that were derived from the poses of a wrong map are wrong, too.
  frame->evidence.weight = tracked.has_pose() ? evidence_of_classes(*tracked.frame).weight
                                              : tracked.frame->evidence.weight;
  frames_.push_back(std::move(frame));
  if (frames_.size() > kMaxFrames) frames_.pop_front();
}

void LostFrames::track_again(const TrackingModel& model, const Map& map, int min_inliers,
                             FrameLog& log) const {
  const TraceScope scope("lost frames");
  LocalMaps maps(map);
  // From the frames after each gap, then from those before it.
  std::vector<FramePtr> left;
  std::copy_if(frames_.rbegin(), frames_.rend(), std::back_inserter(left), [&](const auto& frame) {
    return !track_one(model, maps, min_inliers, *frame, log);
  });
  std::for_each(left.rbegin(), left.rend(),
                [&](const auto& frame) { track_one(model, maps, min_inliers, *frame, log); });
}

}  // namespace stillmap
