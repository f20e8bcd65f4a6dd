// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/mover_error.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/geometry/assignment.hpp"
#include "stillmap/geometry/association.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Largest distance between the centroid of an object and an estimate that matches it [m]
/// (Bernardin: 500 mm). An estimate inside the object's box matches as well, because the camera
/// observes only a part of an object close to it.
constexpr double kMaxDistance = 0.5;
/// Objects shown by fewer pixels do not count as visible.
constexpr int kMinPixels = 600;
/// Objects with a slower centroid count as being at rest [m/s].
constexpr double kMinSpeed = 0.1;
/// Largest difference between the timestamps of one frame [s].
constexpr double kMaxDifference = 0.01;
/// Visible share of an object that counts as whole [0..1].
constexpr double kWhole = 0.8;

/// True and estimated objects of one frame, both in the truth's world.
struct FrameMovers {
  std::vector<MoverPosition> truth, estimate;
};

using ByStamp = std::map<double, std::vector<MoverPosition>>;

/// Returns the frames of the truth, each with the estimates of the nearest timestamp.
std::vector<FrameMovers> frames_of(const ByStamp& truth, const ByStamp& estimate) {
  std::vector<double> true_stamps, stamps;
  for (const auto& [stamp, positions] : truth) true_stamps.push_back(stamp);
  for (const auto& [stamp, positions] : estimate) stamps.push_back(stamp);
  std::vector<FrameMovers> frames;
  for (const auto& [stamp, positions] : truth) frames.push_back({positions, {}});
  for (const auto& [i, k] : associate(true_stamps, stamps, kMaxDifference))
    frames[i].estimate = estimate.at(stamps[k]);
  return frames;
}

class Comparison {
 public:
  void add(const FrameMovers& frame) {
    ++errors_.frames;
    const std::vector<int> estimate_of = match(frame);
    std::vector<char> used(frame.estimate.size(), 0);
    for (std::size_t i = 0; i < frame.truth.size(); ++i) {
      const MoverPosition* estimate = nullptr;
      if (estimate_of[i] >= 0) {
        used[static_cast<std::size_t>(estimate_of[i])] = 1;
        estimate = &frame.estimate[static_cast<std::size_t>(estimate_of[i])];
      }
      count(frame.truth[i], estimate);
    }
    for (std::size_t k = 0; k < used.size(); ++k) {
      ids_.insert(frame.estimate[k].id);
      if (used[k] == 0) {
        ++errors_.false_positives;
        ++estimates_;
      }
    }
    count_pairs(frame);
  }

  MoverErrors finished() {
    errors_.things = objects_.size();
    errors_.tracks = ids_.size();
    errors_.false_tracks = ids_.size() - matched_ids_.size();
    errors_.position = compute_statistics(position_);
    errors_.position_shown = compute_statistics(shown_);
    errors_.position_ground = compute_statistics(ground_);
    errors_.velocity = compute_statistics(velocity_);
    errors_.position_p95 = quantile(position_, 0.95);
    errors_.velocity_p95 = quantile(velocity_, 0.95);
    const auto of = [](std::size_t part, std::size_t whole) {
      return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
    };
    errors_.class_share = of(right_class_, errors_.matches);
    errors_.mota =
        1 - of(errors_.misses + errors_.false_positives + errors_.switches, errors_.positions);
    errors_.idf1 = of(2 * lasting_matches(), errors_.positions + estimates_);
    return errors_;
  }

 private:
  /// Returns whether the object is visible and moves, so that it must be found.
  static bool required(const MoverPosition& truth) {
    return truth.pixels >= kMinPixels && truth.velocity.norm() >= kMinSpeed;
  }

  /// Returns the index of the estimate matched to each true object, -1 for none. Required objects
  /// are matched first, so that objects which are not required get only the remaining estimates.
  std::vector<int> match(const FrameMovers& frame) {
    std::vector<int> estimate_of(frame.truth.size(), -1);
    std::vector<char> free(frame.estimate.size(), 1);
    keep_matches(frame, estimate_of, free);
    for (const bool are_required : {true, false})
      match_rest(frame, are_required, estimate_of, free);
    return estimate_of;
  }

  void keep_matches(const FrameMovers& frame, std::vector<int>& estimate_of,
                    std::vector<char>& free) {
    for (std::size_t i = 0; i < frame.truth.size(); ++i) {
      const auto before = id_of_.find(frame.truth[i].id);
      if (before == id_of_.end()) continue;
      for (std::size_t k = 0; k < frame.estimate.size(); ++k) {
        if (frame.estimate[k].id != before->second || !free[k]) continue;
        if (!near(frame.truth[i], frame.estimate[k])) continue;
        estimate_of[i] = static_cast<int>(k);
        free[k] = 0;
      }
    }
  }

  static void match_rest(const FrameMovers& frame, bool are_required, std::vector<int>& estimate_of,
                         std::vector<char>& free) {
    constexpr double kForbidden = 1e6;
    std::vector<std::size_t> rows, columns;
    for (std::size_t i = 0; i < frame.truth.size(); ++i)
      if (estimate_of[i] < 0 && required(frame.truth[i]) == are_required) rows.push_back(i);
    for (std::size_t k = 0; k < frame.estimate.size(); ++k)
      if (free[k]) columns.push_back(k);
    Eigen::MatrixXd cost(static_cast<Eigen::Index>(rows.size()),
                         static_cast<Eigen::Index>(columns.size()));
    for (Eigen::Index r = 0; r < cost.rows(); ++r) {
      for (Eigen::Index c = 0; c < cost.cols(); ++c) {
        const MoverPosition& truth = frame.truth[rows[static_cast<std::size_t>(r)]];
        const MoverPosition& estimate = frame.estimate[columns[static_cast<std::size_t>(c)]];
        cost(r, c) = near(truth, estimate) ? distance(truth, estimate) : kForbidden;
      }
    }
    const std::vector<int> column_of = assign(cost);
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const int c = column_of[r];
      if (c < 0 || cost(static_cast<Eigen::Index>(r), c) >= kForbidden) continue;
      const std::size_t k = columns[static_cast<std::size_t>(c)];
      estimate_of[rows[r]] = static_cast<int>(k);
      free[k] = 0;
    }
  }

  void count(const MoverPosition& truth, const MoverPosition* estimate) {
    if (estimate != nullptr) matched_ids_.insert(estimate->id);
    if (!required(truth)) return;
    objects_.insert(truth.id);
    ++errors_.positions;
    if (estimate == nullptr) {
      ++errors_.misses;
      return;
    }
    ++errors_.matches;
    ++estimates_;
    const auto before = id_of_.find(truth.id);
    if (before != id_of_.end() && before->second != estimate->id) ++errors_.switches;
    id_of_[truth.id] = estimate->id;
    position_.push_back(distance(truth, *estimate));
    ground_.push_back((truth.centroid - estimate->centroid).head<2>().norm());
    if (truth.shown >= kWhole) shown_.push_back(position_.back());
    velocity_.push_back((truth.velocity - estimate->velocity).norm());
    right_class_ += truth.class_name == estimate->class_name ? 1U : 0U;
  }

  /// Counts, for every pair of a required object and an id, the frames in which they could match.
  void count_pairs(const FrameMovers& frame) {
    for (const MoverPosition& truth : frame.truth) {
      if (!required(truth)) continue;
      for (const MoverPosition& estimate : frame.estimate) {
        if (near(truth, estimate)) ++together_[{truth.id, estimate.id}];
      }
    }
  }

  /// Returns IDTP: the largest number of matches with one id per object.
  std::size_t lasting_matches() const {
    const std::vector<int> objects(objects_.begin(), objects_.end()), ids(ids_.begin(), ids_.end());
    Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(objects.size()),
                                                 static_cast<Eigen::Index>(ids.size()));
    for (const auto& [pair, frames] : together_) {
      gain(std::lower_bound(objects.begin(), objects.end(), pair.first) - objects.begin(),
           std::lower_bound(ids.begin(), ids.end(), pair.second) - ids.begin()) =
          static_cast<double>(frames);
    }
    double sum = 0;
    const std::vector<int> id_of = assign(-gain);
    for (std::size_t i = 0; i < id_of.size(); ++i)
      if (id_of[i] >= 0) sum += gain(static_cast<Eigen::Index>(i), id_of[i]);
    return static_cast<std::size_t>(sum);
  }

  static double distance(const MoverPosition& a, const MoverPosition& b) {
    return (a.centroid - b.centroid).norm();
  }

  /// Returns whether the estimate may belong to the true object.
  static bool near(const MoverPosition& truth, const MoverPosition& estimate) {
    return distance(truth, estimate) <= kMaxDistance ||
           (!truth.box.isEmpty() && truth.box.contains(estimate.centroid));
  }

  MoverErrors errors_;
  std::set<int> objects_, ids_, matched_ids_;
  std::map<int, int> id_of_;  // last matched id by object
  std::map<std::pair<int, int>, std::size_t> together_;
  std::vector<double> position_, shown_, ground_, velocity_;
  std::size_t right_class_ = 0, estimates_ = 0;
};

}  // namespace

MoverErrors compare_movers(const std::vector<MoverPosition>& truth,
                           const std::vector<MoverPosition>& estimate, const Pose& T_truth_estimate,
                           double first, double last) {
  ByStamp true_by_stamp, by_stamp;
  for (const MoverPosition& position : truth) {
    if (position.timestamp >= first - kMaxDifference && position.timestamp <= last + kMaxDifference)
      true_by_stamp[position.timestamp].push_back(position);
  }
  for (MoverPosition position : estimate) {
    if (!position.observed) continue;
    position.centroid = T_truth_estimate * position.centroid;
    position.velocity = T_truth_estimate.quaternion() * position.velocity;
    by_stamp[position.timestamp].push_back(position);
  }
  Comparison comparison;
  const auto frames = frames_of(true_by_stamp, by_stamp);
  const bool common = std::any_of(frames.begin(), frames.end(),
                                  [](const FrameMovers& frame) { return !frame.estimate.empty(); });
  if (!common && !truth.empty() && !by_stamp.empty()) {
    throw Error("the movers have no timestamp in common with the true ones", "movers",
                "name the files of one recording");
  }
  for (const FrameMovers& frame : frames) comparison.add(frame);
  return comparison.finished();
}

std::string mover_error_text(const MoverErrors& e) {
  std::string text = fmt::format(
      "movers: {} in {}, {} ({} false)\n"
      "  position error  median {:.3f}  p95 {:.3f}  mean {:.3f} m;  shown nearly whole: median "
      "{:.3f} m;  along the ground: median {:.3f} m\n"
      "  velocity error  median {:.3f}  p95 {:.3f}  mean {:.3f} m/s\n",
      counted(e.things, "object"), counted(e.frames, "frame"), counted(e.tracks, "track"),
      e.false_tracks, e.position.median, e.position_p95, e.position.mean, e.position_shown.median,
      e.position_ground.median, e.velocity.median, e.velocity_p95, e.velocity.mean);
  return text +
         fmt::format(
             "  {} of {} found, {} missed, {} false, {} identity switches, class right {:.1f} %\n"
             "  MOTA {:.3f}  IDF1 {:.3f}\n",
             e.matches, e.positions, e.misses, e.false_positives, e.switches, 100 * e.class_share,
             e.mota, e.idf1);
}

void to_json(nlohmann::json& json, const MoverErrors& e) {
  json = {{"frames", e.frames},
          {"things", e.things},
          {"tracks", e.tracks},
          {"false_tracks", e.false_tracks},
          {"positions", e.positions},
          {"matches", e.matches},
          {"misses", e.misses},
          {"false_positives", e.false_positives},
          {"switches", e.switches},
          {"position_m", e.position},
          {"position_shown_m", e.position_shown},
          {"position_ground_m", e.position_ground},
          {"position_p95_m", e.position_p95},
          {"velocity_m_s", e.velocity},
          {"velocity_p95_m_s", e.velocity_p95},
          {"class_share", e.class_share},
          {"mota", e.mota},
          {"idf1", e.idf1}};
}

}  // namespace stillmap
