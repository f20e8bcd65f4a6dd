// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_tracker.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/assignment.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Spectral density of the acceleration [m^2/s^3]: within one second the velocity changes by its
/// square root, 0.9 m/s. A person who walks at 0.8 m/s and turns around within two seconds does so.
constexpr double kAcceleration = 0.8;
/// Standard deviation of a detection's centroid, because of swinging limbs [m].
constexpr double kPositionNoise = 0.05;
/// Standard deviation of the centroid of a detection that is cut off by the image border [m].
constexpr double kCutOffNoise = 0.2;
/// Standard deviation of the speed of a new track [m/s].
constexpr double kInitialSpeed = 1;
/// Largest squared Mahalanobis distance of an assignment: 99.9 % of a chi-square distribution with
/// three degrees of freedom.
constexpr double kGate = 16.3;
/// Standard deviation of the distance of an object's appearance from that of its track [0..1]; that
/// of two objects is mostly above 0.45.
constexpr double kColorNoise = 0.2;
/// Largest distance of an assignment, whatever the uncertainty [m].
constexpr double kReach = 0.8;
/// Number of detections in a row that make a track.
constexpr int kBirths = 3;
/// Time that a track lives without a detection, and that one of a known class is assigned
/// detections that do not confirm it [s].
constexpr double kSurvival = 1.5;
/// Share of an object's remembered extent that lasts over one more detection.
constexpr double kExtentMemory = 0.9;
/// Time in which the velocity of an unseen object falls to 1 / e [s].
constexpr double kSlowing = 0.7;
/// A detection this close to the box of a track starts no track of its own [m].
constexpr double kFragment = 0.15;
/// Number of frames in a row in the box of another track after which two tracks become one.
constexpr int kMergeAfter = 8;

const std::string kUnknown = "unknown";

double square(double x) { return x * x; }

Eigen::AlignedBox3d grown(const Eigen::AlignedBox3d& box, double margin) {
  return {box.min().array() - margin, box.max().array() + margin};
}

/// Returns the axis-aligned box around a transformed box.
Eigen::AlignedBox3d transformed(const Eigen::AlignedBox3d& box, const Pose& T) {
  const Eigen::Vector3d half = T.rotation().cwiseAbs() * (box.sizes() / 2);
  const Eigen::Vector3d middle = T * box.center();
  return {middle - half, middle + half};
}

double variance_of(const MoverDetection& detection) {
  return square(detection.cut_off ? kCutOffNoise : kPositionNoise);
}

/// Returns whether a detection is evidence of an object of its own: it has a class or moves. Other
/// detections are surfaces with motion evidence that were in the same place before.
bool confirms(const MoverDetection& detection) {
  return detection.moves || detection.class_name != kUnknown;
}

}  // namespace

MoverSample moved(const MoverSample& sample, const Pose& T) {
  MoverSample result = sample;
  result.centroid = T * sample.centroid;
  result.velocity = T.quaternion() * sample.velocity;
  result.box = transformed(sample.box, T);
  result.surface = transformed(sample.surface, T);
  return result;
}

std::string MoverTracker::Track::class_name() const {
  const auto most = std::max_element(
      votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == votes.end() ? kUnknown : most->first;
}

double MoverTracker::Track::class_confidence() const {
  const auto found = votes.find(class_name());
  return found == votes.end() ? 0 : found->second / detections;
}

double MoverTracker::Track::last_seen() const {
  const auto last = std::find_if(samples.rbegin(), samples.rend(),
                                 [](const MoverSample& sample) { return sample.observed; });
  return last == samples.rend() ? 0 : last->timestamp;
}

void MoverTracker::update(std::size_t frame_index, double timestamp, const Pose& T_world_camera,
                          const std::vector<MoverDetection>& detections) {
  const TraceScope scope("track");
  frame_index_ = frame_index;
  for (Track& track : tracks_) predict(track, timestamp);
  timestamp_ = timestamp;
  const std::vector<int> track_of = assigned_tracks(detections);
  std::vector<const MoverDetection*> seen(tracks_.size(), nullptr);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (track_of[i] < 0) continue;
    const auto k = static_cast<std::size_t>(track_of[i]);
    correct(tracks_[k], completed(tracks_[k], detections[i]));
    seen[k] = &detections[i];
  }
  for (std::size_t k = 0; k < tracks_.size(); ++k) add_sample(tracks_[k], seen[k]);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    if (track_of[i] >= 0 || !detections[i].moves || is_fragment(detections[i])) continue;
    tracks_.push_back(begin(detections[i]));
    add_sample(tracks_.back(), &detections[i]);
  }
  retire();
  merge();
  for (Track& track : tracks_) {
    if (track.id == 0 && track.detections >= kBirths) track.id = ++newest_id_;
  }
  if (!tracks_.empty()) T_world_camera_[frame_index] = T_world_camera;
}

/// Predicts a track by x <- F x, P <- F P F' + Q; the velocity of an unseen object decays.
void MoverTracker::predict(Track& track, double timestamp) const {
  const double dt = timestamp - *timestamp_;
  const bool unseen = !track.samples.empty() && !track.samples.back().observed;
  if (unseen) track.v *= std::exp(-dt / kSlowing);
  track.p += track.v * dt;
  Eigen::Matrix2d F, Q;
  F << 1, dt, 0, 1;
  Q << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt;
  track.P = F * track.P * F.transpose() + kAcceleration * Q;
}

/// Returns the detection completed by its hidden parts, if the track remembers the full extent.
/// Objects of unknown class swing and turn, which changes their extent, and stay unchanged.
MoverDetection MoverTracker::completed(const Track& track, const MoverDetection& detection) const {
  MoverDetection whole = detection;
  if (track.class_name() == kUnknown) return whole;
  bool all_known = true;
  for (std::size_t i = 0; i < detection.spans.size(); ++i) {
    const VisibleSpan& span = detection.spans[i];
    if (!span.low_hidden && !span.high_hidden) continue;
    const bool known = track.extent[i] && span.low_hidden != span.high_hidden;
    all_known &= known;
    if (!known || *track.extent[i] <= span.extent) continue;
    const Eigen::Vector3d hidden =
        (span.high_hidden ? 1 : -1) * (*track.extent[i] - span.extent) * span.axis;
    whole.centroid += hidden / 2;
    whole.box.extend(whole.box.translated(hidden));
  }
  whole.cut_off &= !all_known;
  return whole;
}

/// Returns the cost of an assignment; infinite if the two cannot be one object.
double MoverTracker::cost(const Track& track, const MoverDetection& detection) const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const std::string name = track.class_name();
  if (name != kUnknown && detection.class_name != kUnknown && name != detection.class_name)
    return kNever;
  if (name != kUnknown && !confirms(detection) && *timestamp_ - track.confirmed > kSurvival)
    return kNever;
  const double S = track.P(0, 0) + variance_of(detection);
  const double distance = (detection.centroid - track.p).squaredNorm();
  if (distance > square(kReach) || distance > kGate * S) return kNever;
  const double colors = track.appearance.distance(detection.appearance).value_or(kColorNoise);
  return distance / S + 3 * std::log(S / square(kPositionNoise)) + square(colors / kColorNoise);
}

/// Returns per detection the index of its track, or -1 for none.
std::vector<int> MoverTracker::assigned_tracks(
    const std::vector<MoverDetection>& detections) const {
  constexpr double kForbidden = 1e6;  // more than any sum of costs within the gate
  const auto rows = static_cast<Eigen::Index>(detections.size());
  const auto columns = static_cast<Eigen::Index>(tracks_.size());
  Eigen::MatrixXd costs(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index k = 0; k < columns; ++k) {
      const Track& track = tracks_[static_cast<std::size_t>(k)];
      const MoverDetection& detection = detections[static_cast<std::size_t>(i)];
      costs(i, k) = std::min(kForbidden, cost(track, completed(track, detection)));
    }
  }
  std::vector<int> track_of = assign(costs);
  for (Eigen::Index i = 0; i < rows; ++i) {
    int& track = track_of[static_cast<std::size_t>(i)];
    if (track >= 0 && costs(i, track) >= kForbidden) track = -1;
  }
  return track_of;
}

void MoverTracker::correct(Track& track, const MoverDetection& detection) const {
  const Eigen::Vector2d K = track.P.col(0) / (track.P(0, 0) + variance_of(detection));
  const Eigen::Vector3d innovation = detection.centroid - track.p;
  track.p += K(0) * innovation;
  track.v += K(1) * innovation;
  track.P -= K * track.P.row(0).eval();
  observe(track, detection);
}

void MoverTracker::observe(Track& track, const MoverDetection& detection) const {
  ++track.detections;
  if (confirms(detection)) track.confirmed = *timestamp_;
  track.appearance.add(detection.appearance);
  if (detection.class_name != kUnknown)
    track.votes[detection.class_name] += detection.class_confidence;
  for (std::size_t i = 0; i < detection.spans.size(); ++i) {
    const VisibleSpan& span = detection.spans[i];
    if (span.low_hidden || span.high_hidden) continue;
    const double before = track.extent[i].value_or(span.extent);
    track.extent[i] = kExtentMemory * before + (1 - kExtentMemory) * span.extent;
  }
  track.box_offset = detection.box.translated(-track.p);
  track.surface_offset = detection.surface.translated(-track.p);
}

MoverTracker::Track MoverTracker::begin(const MoverDetection& detection) const {
  Track track;
  track.world = world_;
  track.p = detection.centroid;
  track.v = Eigen::Vector3d::Zero();
  track.P << variance_of(detection), 0, 0, square(kInitialSpeed);
  observe(track, detection);
  return track;
}

/// Returns whether a detection is part of a tracked object, such as an arm or a piece cut off by an
/// occluder.
bool MoverTracker::is_fragment(const MoverDetection& detection) const {
  return std::any_of(tracks_.begin(), tracks_.end(), [&](const Track& track) {
    return track.id != 0 && track.samples.back().observed &&
           grown(track.box_offset.translated(track.p), kFragment).contains(detection.centroid);
  });
}

/// Adds this frame's sample to a track.
/// @param detection the track's detection in this frame, or null
void MoverTracker::add_sample(Track& track, const MoverDetection* detection) const {
  track.samples.push_back({frame_index_, *timestamp_, detection != nullptr,
                           detection != nullptr && detection->moves, track.p, track.v,
                           track.box_offset.translated(track.p),
                           track.surface_offset.translated(track.p)});
}

/// Ends the tracks without detections for too long; before its birth a track needs one per frame.
void MoverTracker::retire() {
  std::vector<Track> alive;
  for (Track& track : tracks_) {
    const double patience = track.id == 0 ? 0 : kSurvival;
    if (*timestamp_ - track.last_seen() <= patience) {
      alive.push_back(std::move(track));
    } else {
      archive(std::move(track));
    }
  }
  tracks_ = std::move(alive);
}

/// Keeps a track up to its last detection, if it was born; of a known class, up to the last one
/// that confirms it.
void MoverTracker::archive(Track&& track) {
  if (track.id == 0) return;
  const bool known = track.class_name() != kUnknown;
  while (!track.samples.back().observed ||
         (known && track.samples.back().timestamp > track.confirmed))
    track.samples.pop_back();
  ended_.push_back(std::move(track));
}

/// Merges tracks that stay within one another while both are detected, as two people cannot be at
/// one place. A track hidden behind another one is not detected and stays separate.
void MoverTracker::merge() {
  for (std::size_t k = 1; k < tracks_.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      Track &older = tracks_[i], &younger = tracks_[k];
      if (older.id == 0 || younger.id == 0) continue;
      const bool within = older.box_offset.translated(older.p).contains(younger.p) &&
                          older.samples.back().observed && younger.samples.back().observed;
      int& frames = younger.inside[older.id];
      frames = within ? frames + 1 : 0;
      if (frames < kMergeAfter) continue;
      absorb(older, younger);
      tracks_.erase(tracks_.begin() + static_cast<std::ptrdiff_t>(k));
      --k;
      break;
    }
  }
}

/// Continues the older track; samples of the younger one replace its predictions.
void MoverTracker::absorb(Track& older, const Track& younger) const {
  for (MoverSample& sample : older.samples) {
    if (sample.observed) continue;
    const auto other = std::find_if(
        younger.samples.begin(), younger.samples.end(),
        [&](const MoverSample& s) { return s.frame_index == sample.frame_index && s.observed; });
    if (other != younger.samples.end()) sample = *other;
  }
  for (const auto& [name, vote] : younger.votes) older.votes[name] += vote;
  older.detections += younger.detections;
  older.confirmed = std::max(older.confirmed, younger.confirmed);
  older.appearance.add(younger.appearance);
}

void MoverTracker::move(const Pose& T_corrected_world) {
  const Pose turn(T_corrected_world.quaternion(), Eigen::Vector3d::Zero());
  for (Track& track : tracks_) {
    track.p = T_corrected_world * track.p;
    track.v = turn * track.v;
    track.box_offset = transformed(track.box_offset, turn);
    track.surface_offset = transformed(track.surface_offset, turn);
  }
}

void MoverTracker::restart() {
  for (Track& track : tracks_) archive(std::move(track));
  tracks_.clear();
  timestamp_.reset();
  ++world_;
}

Mover MoverTracker::mover(const Track& track) const {
  return {track.id,
          track.class_name(),
          track.class_confidence(),
          track.samples.front().timestamp,
          track.last_seen(),
          track.samples.back()};
}

std::vector<Mover> MoverTracker::current() const {
  std::vector<Mover> movers;
  for (const Track& track : tracks_) {
    if (track.id != 0) movers.push_back(mover(track));
  }
  std::sort(movers.begin(), movers.end(),
            [](const Mover& a, const Mover& b) { return a.id < b.id; });
  return movers;
}

/// Returns identity, class and appearance of a track.
MoverTrack MoverTracker::without_samples(const Track& track) const {
  MoverTrack result;
  result.id = track.id;
  result.class_name = track.class_name();
  result.class_confidence = track.class_confidence();
  result.world = track.world;
  result.appearance = track.appearance;
  return result;
}

std::vector<MoverTrack> MoverTracker::tracks_since(std::size_t frame_index) const {
  std::vector<MoverTrack> result;
  const auto add = [&](const Track& track) {
    if (track.id == 0 || track.samples.back().frame_index < frame_index) return;
    MoverTrack since = without_samples(track);
    const auto first = std::lower_bound(
        track.samples.begin(), track.samples.end(), frame_index,
        [](const MoverSample& sample, std::size_t index) { return sample.frame_index < index; });
    since.samples.assign(first, track.samples.end());
    result.push_back(std::move(since));
  };
  for (const Track& track : ended_) add(track);
  for (const Track& track : tracks_) add(track);
  std::sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  return result;
}

std::vector<MoverTrack> MoverTracker::tracks(
    const std::function<std::optional<Pose>(std::size_t)>& pose_of) const {
  MoverTracker done = *this;
  done.restart();
  std::sort(done.ended_.begin(), done.ended_.end(),
            [](const Track& a, const Track& b) { return a.id < b.id; });
  std::vector<MoverTrack> result;
  for (const Track& track : done.ended_) {
    MoverTrack corrected = without_samples(track);
    for (const MoverSample& sample : track.samples) {
      const auto T_world_camera = pose_of(sample.frame_index);
      if (!T_world_camera) continue;
      corrected.samples.push_back(
          moved(sample, *T_world_camera * T_world_camera_.at(sample.frame_index).inverse()));
    }
    if (corrected.samples.empty()) continue;
    corrected.first_seen = corrected.samples.front().timestamp;
    corrected.last_seen = corrected.samples.back().timestamp;
    result.push_back(std::move(corrected));
  }
  return result;
}

}  // namespace stillmap
