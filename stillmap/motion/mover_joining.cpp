// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_joining.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace stillmap {
namespace {

/// Longest absence of an object after which its track continues [s].
constexpr double kMaxAbsence = 10;
/// Longest way of an unseen object: this distance [m], as its centroid is that of the visible part,
/// plus the way at a brisk walk [m/s].
constexpr double kReach = 0.8, kWalkingSpeed = 1.6;
/// Time over which the velocity at the end of a track is measured, and over which it lasts [s].
constexpr double kVelocityTime = 0.4, kVelocityLasts = 0.7;
/// Largest distance of the appearances of one object [0..1]: in simulated scenes that of two tracks
/// of one person is mostly .10 to .30, that of two people mostly above .45.
constexpr double kSameAppearance = 0.4;
/// An appearance is that of the same object if its distance is less than this share of the
/// distance to any other object that was visible at the same time; chosen on simulated scenes.
constexpr double kDistinct = 0.8;
/// Longest absence of an object of unknown appearance [s], and the minimum number of detections of
/// a known appearance: fewer may come from one blurred image.
constexpr double kMaxAbsenceWithoutColors = 1.5;
constexpr int kMinColored = 5;
/// Share of the frames with both detections in which two tracks of one object are within each
/// other.
constexpr double kWithinShare = 0.5;
/// Distance of two detections of one object, if none is in the box of the other [m].
constexpr double kSamePlace = 0.3;
/// Minimum number of common frames that tell whether two tracks are one object: for a few frames
/// the tracker may assign a part of a person, or the person next to it, to a track that ends.
constexpr int kMinCommon = 5;
/// Tracks that are detected as moving for less than this time [s] are left out, unless they move
/// by this distance [m] at more than this speed [m/s].
constexpr double kMinTime = 0.5, kMinWay = 1, kMinSpeed = 2;
/// Largest interval of consecutive frames [s].
constexpr double kMaxInterval = 0.25;

constexpr double kNever = std::numeric_limits<double>::infinity();

/// Number of frames in which two tracks are both detected.
struct Common {
  int frames = 0;
  int within = 0;  // at one place

  bool is_double() const { return frames >= kMinCommon && within >= kWithinShare * frames; }
  bool differ() const { return frames - within >= kMinCommon && !is_double(); }
};

bool at_one_place(const MoverSample& a, const MoverSample& b) {
  return (a.centroid - b.centroid).norm() < kSamePlace || a.box.contains(b.centroid) ||
         b.box.contains(a.centroid);
}

Common common_frames(const MoverTrack& a, const MoverTrack& b) {
  Common common;
  if (a.last_seen < b.first_seen || b.last_seen < a.first_seen) return common;
  for (auto i = a.samples.begin(), k = b.samples.begin();
       i != a.samples.end() && k != b.samples.end();) {
    if (i->frame_index != k->frame_index) {
      ++(i->frame_index < k->frame_index ? i : k);
      continue;
    }
    if (i->observed && k->observed) {
      ++common.frames;
      common.within += at_one_place(*i, *k) ? 1 : 0;
    }
    ++i;
    ++k;
  }
  return common;
}

bool may_have_one_class(const MoverTrack& a, const MoverTrack& b) {
  return a.class_name == b.class_name || a.class_name == "unknown" || b.class_name == "unknown";
}

/// Returns the mean velocity around a sample, over the detections before it (direction -1) or
/// after it (1), or zero.
Eigen::Vector3d velocity_at(const MoverTrack& track, std::size_t at, int direction) {
  const MoverSample& here = track.samples[at];
  const MoverSample* there = &here;
  for (auto i = static_cast<std::ptrdiff_t>(at);
       i >= 0 && i < static_cast<std::ptrdiff_t>(track.samples.size()); i += direction) {
    const MoverSample& sample = track.samples[static_cast<std::size_t>(i)];
    if (std::abs(sample.timestamp - here.timestamp) > kVelocityTime) break;
    if (sample.observed) there = &sample;
  }
  const double time = there->timestamp - here.timestamp;
  if (std::abs(time) < kVelocityTime / 2) return Eigen::Vector3d::Zero();
  return (there->centroid - here.centroid) / time;
}

/// Returns how far an object must have left its predicted path to get from one detection to
/// another, as a share of the way that is possible; above 1 it is impossible.
double detour(const MoverTrack& a, std::size_t from, const MoverTrack& b, std::size_t to) {
  const MoverSample &start = a.samples[from], &end = b.samples[to];
  const double time = end.timestamp - start.timestamp;
  const double way = kReach + kWalkingSpeed * time;
  if ((end.centroid - start.centroid).norm() > way) return kNever;
  const double lasts = std::min(time / 2, kVelocityLasts);
  const Eigen::Vector3d left = start.centroid + lasts * velocity_at(a, from, -1);
  const Eigen::Vector3d came = end.centroid - lasts * velocity_at(b, to, 1);
  return (came - left).norm() / way;
}

/// Returns the frame of a sample; the largest number beyond the last one.
std::size_t frame_at(const MoverTrack& track, std::size_t sample) {
  return sample < track.samples.size() ? track.samples[sample].frame_index
                                       : std::numeric_limits<std::size_t>::max();
}

int detections_of(const MoverTrack& track) {
  return static_cast<int>(std::ranges::count_if(track.samples, &MoverSample::observed));
}

/// Returns the distance between the appearances of two tracks; none if one of them is unknown.
std::optional<double> appearance_distance(const MoverTrack& a, const MoverTrack& b) {
  if (std::min(detections_of(a), detections_of(b)) < kMinColored) return std::nullopt;
  return a.appearance.distance(b.appearance);
}

struct Transition {
  double detour = 0;   // the largest; see detour()
  double absence = 0;  // the longest [s]
};

/// Returns the worst of the changes from one track to the other, if both are one object. Frames
/// that detect both are left out: there one of them may be a part of the object.
Transition transition(const MoverTrack& a, const MoverTrack& b) {
  Transition worst;
  const MoverTrack* before = nullptr;
  std::size_t last = 0;
  for (std::size_t i = 0, k = 0; i < a.samples.size() || k < b.samples.size();) {
    const std::size_t frame_a = frame_at(a, i), frame_b = frame_at(b, k);
    const bool both = frame_a == frame_b && a.samples[i].observed && b.samples[k].observed;
    const MoverTrack& now = frame_a <= frame_b ? a : b;
    const std::size_t here = frame_a <= frame_b ? i++ : k++;
    if (both) ++k;
    if (both || !now.samples[here].observed) continue;
    if (before != nullptr && before != &now) {
      const double absence = now.samples[here].timestamp - before->samples[last].timestamp;
      worst.absence = std::max(worst.absence, absence);
      if (absence > kMaxAbsence) return {kNever, absence};
      worst.detour = std::max(worst.detour, detour(*before, last, now, here));
    }
    before = &now;
    last = here;
  }
  return worst;
}

/// Returns the time in which a track is detected as moving, without the gaps between its parts [s].
double moving_time(const MoverTrack& track) {
  double time = 0;
  for (std::size_t i = 1; i < track.samples.size(); ++i) {
    const double interval = track.samples[i].timestamp - track.samples[i - 1].timestamp;
    if (track.samples[i].moves && interval <= kMaxInterval) time += interval;
  }
  return time;
}

bool is_fragment(const MoverTrack& track) {
  if (track.samples.empty()) return true;
  const double way = (track.samples.back().centroid - track.samples.front().centroid).norm();
  const bool fast = way >= kMinWay && way >= kMinSpeed * (track.last_seen - track.first_seen);
  return moving_time(track) < kMinTime && !fast;
}

class Joining {
 public:
  explicit Joining(std::vector<MoverTrack> tracks) : tracks_(std::move(tracks)) {}

  std::vector<MoverTrack> joined() {
    join_all([this](std::size_t a, std::size_t b) { return cost_as_double(a, b); });
    join_all([this](std::size_t a, std::size_t b) { return cost_as_continuation(a, b); });
    std::erase_if(tracks_, [](const MoverTrack& track) { return track.samples.empty(); });
    return std::move(tracks_);
  }

 private:
  /// Joins the pair of least cost until no finite cost is left. After each, the costs of the joined
  /// track are computed anew.
  template <typename Cost>
  void join_all(const Cost& cost_of) {
    const auto count = static_cast<Eigen::Index>(tracks_.size());
    Eigen::MatrixXd costs = Eigen::MatrixXd::Constant(count, count, kNever);
    const auto update = [&](Eigen::Index a, Eigen::Index b) {
      costs(a, b) = cost_of(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
    };
    for (Eigen::Index b = 1; b < count; ++b)
      for (Eigen::Index a = 0; a < b; ++a) update(a, b);
    for (;;) {
      Eigen::Index a = 0, b = 0;
      if (count == 0 || costs.minCoeff(&a, &b) == kNever) return;
      join(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
      costs.row(b).setConstant(kNever);
      costs.col(b).setConstant(kNever);
      for (Eigen::Index other = 0; other < count; ++other)
        if (other != a) update(std::min(a, other), std::max(a, other));
    }
  }

  bool may_be_one(std::size_t a, std::size_t b) const {
    const MoverTrack &s = tracks_[a], &t = tracks_[b];
    return !s.samples.empty() && !t.samples.empty() && s.world == t.world &&
           s.first_seen <= t.last_seen + kMaxAbsence && t.first_seen <= s.last_seen + kMaxAbsence &&
           may_have_one_class(s, t);
  }

  double cost_as_double(std::size_t a, std::size_t b) const {
    if (!may_be_one(a, b)) return kNever;
    const Common common = common_frames(tracks_[a], tracks_[b]);
    return common.is_double() ? -common.within : kNever;
  }

  double cost_as_continuation(std::size_t a, std::size_t b) const {
    if (!may_be_one(a, b) || common_frames(tracks_[a], tracks_[b]).differ()) return kNever;
    const Transition change = transition(tracks_[a], tracks_[b]);
    if (change.detour > 1) return kNever;
    const auto distance = appearance_distance(tracks_[a], tracks_[b]);
    const double motion_cost = change.detour + change.absence / kMaxAbsence;
    if (!distance) return change.absence <= kMaxAbsenceWithoutColors ? 1 + motion_cost : kNever;
    const double limit = largest_distance(a, b);
    return *distance < limit ? *distance / limit + motion_cost : kNever;
  }

  /// Returns the largest distance of the appearances of two tracks of one object: below those to
  /// other objects that were visible at the same time as one of the two.
  double largest_distance(std::size_t a, std::size_t b) const {
    double limit = kSameAppearance;
    for (std::size_t other = 0; other < tracks_.size(); ++other) {
      for (const std::size_t one : {a, b}) {
        if (other == a || other == b || is_fragment(tracks_[other]) ||
            !common_frames(tracks_[one], tracks_[other]).differ())
          continue;
        const auto distance = tracks_[one].appearance.distance(tracks_[other].appearance);
        if (distance) limit = std::min(limit, kDistinct * *distance);
      }
    }
    return limit;
  }

  /// Adds the second track to the first one, and leaves the second one without samples. Where both
  /// have a sample, a detection replaces a prediction.
  void join(std::size_t first, std::size_t second) {
    MoverTrack &a = tracks_[first], &b = tracks_[second];
    std::vector<MoverSample> samples;
    for (auto i = a.samples.begin(), k = b.samples.begin();
         i != a.samples.end() || k != b.samples.end();) {
      if (k == b.samples.end() || (i != a.samples.end() && i->frame_index < k->frame_index)) {
        samples.push_back(*i++);
      } else if (i == a.samples.end() || k->frame_index < i->frame_index) {
        samples.push_back(*k++);
      } else {
        samples.push_back(k->observed && !i->observed ? *k : *i);
        ++i;
        ++k;
      }
    }
    const auto weight = [](const MoverTrack& track) {
      return track.class_name == "unknown" ? 0 : static_cast<double>(track.samples.size());
    };
    const double share = weight(b) == 0 ? 0 : weight(b) / (weight(a) + weight(b));
    if (a.class_name == "unknown") a.class_name = b.class_name;
    a.class_confidence += share * (b.class_confidence - a.class_confidence);
    a.first_seen = std::min(a.first_seen, b.first_seen);
    a.last_seen = std::max(a.last_seen, b.last_seen);
    a.appearance.add(b.appearance);
    a.samples = std::move(samples);
    b.samples.clear();
  }

  std::vector<MoverTrack> tracks_;  // by id; those added to others have no samples
};

}  // namespace

std::vector<MoverTrack> joined_movers(std::vector<MoverTrack> tracks) {
  std::vector<MoverTrack> joined = Joining(std::move(tracks)).joined();
  std::erase_if(joined, is_fragment);
  return joined;
}

}  // namespace stillmap
