// SPDX-License-Identifier: Apache-2.0
/// Precision and recall of place recognition against ground truth:
///
///     ninja -C build/release stillmap_place_recall
///     build/release/modules/loop/stillmap_place_recall [--vocabulary FILE] SEQUENCE...
///
/// The sequences (TUM layout, groundtruth.txt in one common world) give every 10th frame; keypoints
/// marked in mask/ are excluded. Two frames of one sequence at least 3 s apart, or of two
/// sequences,
/// show the same place if the cameras are within 0.5 m and 30 degrees. Output:
/// - pairs: all pairs by falling score; average precision (area under precision over recall);
/// - queries: the most similar other frame of each frame; recall over the frames with a true match;
///   precision and recall over the score relative to the neighbor's (10 frames earlier, as in
/// DBoW2);
/// - time [ms] to load the vocabulary, to compute a bag of words, and to query the inverted index.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {
namespace {

constexpr int kStride = 10;
constexpr double kApart = 3.0;  // Minimum time between two frames of a pair [s].
constexpr double kMeters = 0.5, kRadians = 30 * std::numbers::pi / 180;

struct View {
  std::size_t sequence = 0;
  double timestamp = 0;
  Pose T_world_camera;
  std::vector<Descriptor> descriptors;
  BowVector bag;
};

/// Returns the pose nearest in time, within 20 ms.
std::optional<Pose> pose_at(const Trajectory& trajectory, double timestamp) {
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), timestamp,
                       [](const StampedPose& p, double t) { return p.timestamp < t; });
  std::optional<Pose> nearest;
  double best = 0.02;
  for (auto it = after == trajectory.begin() ? after : after - 1;
       it != trajectory.end() && it <= after; ++it) {
    const double gap = std::abs(it->timestamp - timestamp);
    if (gap < best) best = gap, nearest = it->T_world_camera;
  }
  return nearest;
}

std::vector<Descriptor> static_descriptors(const Features& features, const cv::Mat& mask) {
  std::vector<Descriptor> kept;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    const cv::Point at(static_cast<int>(k.u + 0.5F), static_cast<int>(k.v + 0.5F));
    if (mask.empty() || mask.at<std::uint8_t>(at) == 0) kept.push_back(features.descriptors[i]);
  }
  return kept;
}

std::vector<View> views_of(const std::string& folder, std::size_t sequence) {
  const SequencePaths paths = find_sequence(folder);
  const Trajectory truth = read_trajectory(paths.ground_truth);
  TumFolderOptions options;
  options.stride = kStride;
  TumFolder source(paths, load_camera(paths.camera.string()), options);
  OrbExtractor orb;
  std::vector<View> views;
  while (const auto frame = source.next()) {
    const auto pose = pose_at(truth, frame->timestamp);
    if (!pose) continue;
    cv::Mat mask;
    if (!paths.masks.empty()) {
      const auto& files = source.frames()[frame->index];
      mask = cv::imread((paths.masks / files.color.filename()).string(), cv::IMREAD_GRAYSCALE);
    }
    views.push_back({sequence,
                     frame->timestamp,
                     *pose,
                     static_descriptors(orb.extract(frame->gray), mask),
                     {}});
  }
  return views;
}

bool comparable(const View& a, const View& b) {
  return a.sequence != b.sequence || std::abs(a.timestamp - b.timestamp) >= kApart;
}

bool one_place(const View& a, const View& b) {
  const Pose T_a_b = a.T_world_camera.inverse() * b.T_world_camera;
  return T_a_b.translation().norm() <= kMeters && T_a_b.angle() <= kRadians;
}

struct Answer {
  double score = 0;
  bool right = false;
};

void sort_by_score(std::vector<Answer>& answers) {
  std::stable_sort(answers.begin(), answers.end(),
                   [](const Answer& a, const Answer& b) { return a.score > b.score; });
}

double average_precision(std::vector<Answer> answers) {
  sort_by_score(answers);
  double sum = 0, right = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (answers[i].right) sum += ++right / static_cast<double>(i + 1);
  }
  return right > 0 ? sum / right : 0;
}

void report_pairs(const std::vector<View>& views) {
  std::vector<Answer> answers;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (comparable(views[i], views[j]))
        answers.push_back({similarity(views[i].bag, views[j].bag), one_place(views[i], views[j])});
    }
  }
  const auto right = std::count_if(answers.begin(), answers.end(), [](auto& a) { return a.right; });
  fmt::print("  pairs: {} of {} show the same place; average precision {:.3f}\n", right,
             answers.size(), average_precision(answers));
}

/// Returns the most similar comparable view, with its score relative to the neighbor's.
std::optional<Answer> answer(const std::vector<View>& views, std::size_t query, bool& answerable) {
  const View& view = views[query];
  if (query == 0 || views[query - 1].sequence != view.sequence) return std::nullopt;
  const double neighbor = similarity(view.bag, views[query - 1].bag);
  Answer best;
  for (const View& other : views) {
    if (!comparable(view, other)) continue;
    const bool right = one_place(view, other);
    answerable |= right;
    const double score = similarity(view.bag, other.bag) / std::max(neighbor, 1e-3);
    if (score > best.score) best = {score, right};
  }
  return best;
}

void report_queries(const std::vector<View>& views) {
  std::vector<Answer> answers;
  int answerable_ones = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    bool answerable = false;
    if (const auto a = answer(views, i, answerable)) answers.push_back(*a);
    answerable_ones += answerable;
  }
  fmt::print("  queries: {}, {} have an answer; relative score: precision, recall\n   ",
             answers.size(), answerable_ones);
  for (const double least : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2}) {
    int given = 0, right = 0;
    for (const Answer& a : answers) {
      given += a.score >= least;
      right += a.score >= least && a.right;
    }
    fmt::print(" {:.1f}: {:.3f} {:.3f};", least, given > 0 ? static_cast<double>(right) / given : 1,
               answerable_ones > 0 ? static_cast<double>(right) / answerable_ones : 0);
  }
  fmt::print("\n");
}

void report_times(const Vocabulary& vocabulary, const std::vector<View>& views) {
  PlaceIndex index(std::make_shared<const Vocabulary>(vocabulary));
  Map map(Camera{}, PyramidShape{});
  Stopwatch watch;
  for (const View& view : views) {
    auto features = std::make_shared<Features>();
    features->descriptors = view.descriptors;
    features->keypoints.resize(view.descriptors.size());
    Keyframe keyframe;
    keyframe.static_weight.assign(features->size(), 1);
    keyframe.features = std::move(features);
    index.insert(map.add_keyframe(std::move(keyframe)));
  }
  const double inserted = watch.lap();
  std::size_t found = 0;
  for (const View& view : views) found += index.scores(view.bag).size();
  fmt::print("  {:.3f} ms to insert, {:.3f} ms to query among {} keyframes ({} scores)\n",
             inserted / static_cast<double>(views.size()),
             watch.lap() / static_cast<double>(views.size()), views.size(), found);
}

void report(const std::string& file, std::vector<View>& views) {
  Stopwatch watch;
  const Vocabulary vocabulary =
      file.empty() ? Vocabulary::built_in() : Vocabulary::from_bytes(read_file(file), file);
  const double load = watch.lap();
  for (View& view : views) view.bag = vocabulary.transform(view.descriptors).words;
  const double transform = watch.lap();
  fmt::print("{}: {} words, loaded in {:.2f} ms, bag in {:.3f} ms\n",
             file.empty() ? "built in" : file, vocabulary.words(), load,
             transform / static_cast<double>(views.size()));
  report_pairs(views);
  report_queries(views);
  report_times(vocabulary, views);
}

int run(int argc, char** argv) {
  std::vector<std::string> vocabularies;
  std::vector<View> views;
  std::size_t sequences = 0;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--vocabulary") == 0 && i + 1 < argc) {
      vocabularies.emplace_back(argv[++i]);
      continue;
    }
    auto more = views_of(argv[i], sequences++);
    std::move(more.begin(), more.end(), std::back_inserter(views));
  }
  if (views.empty()) throw Error("no sequence was named", "", "name folders with groundtruth.txt");
  if (vocabularies.empty()) vocabularies.emplace_back();
  for (const std::string& file : vocabularies) report(file, views);
  return 0;
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  try {
    return stillmap::run(argc, argv);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
