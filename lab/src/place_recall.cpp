// SPDX-License-Identifier: Apache-2.0
/// Precision and recall of place recognition, against ground truth. The sequences (all of one
/// world) give every 10th frame; keypoints in their masks (mask/) are left out, as the motion cues
/// would do. Two frames of one sequence at least 3 s apart, or of two sequences, show the same
/// place if the cameras were within 0.5 m and 30 degrees. Printed:
/// - pairs: average precision over all of them (area below the precision-recall curve);
/// - queries: whether the most similar frame shows the same place; recall counts the frames for
///   which there is such a frame. The threshold is on the score relative to that of the previous
///   frame (the normalization of DBoW2);
/// - milliseconds to load the vocabulary, to make a bag of words, and to query the inverted index.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <numbers>
#include <optional>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

constexpr int kStride = 10;
constexpr double kApart = 3.0;  // least time between two comparable frames of a sequence [s]
constexpr double kMeters = 0.5, kRadians = 30 * std::numbers::pi / 180;

struct View {
  std::size_t sequence = 0;
  double timestamp = 0;
  Pose T_world_camera;
  std::vector<Descriptor> descriptors;
  BowVector bag;
};

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
  FrameRange options;
  options.stride = kStride;
  TumFolder source(paths, read_camera(paths.camera.string()), options);
  OrbExtractor orb;
  std::vector<View> views;
  while (const auto frame = source.next()) {
    const auto pose = pose_at(truth, frame->timestamp);
    if (!pose) continue;
    cv::Mat mask;
    if (!paths.masks.empty()) {
      const auto& files = source.frames()[frame->index];
      mask = read_stored_image(paths.masks / files.color.filename()).image;
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

bool same_place(const View& a, const View& b) {
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
        answers.push_back({similarity(views[i].bag, views[j].bag), same_place(views[i], views[j])});
    }
  }
  const auto right = std::count_if(answers.begin(), answers.end(), [](auto& a) { return a.right; });
  fmt::print("  pairs: {} of {} show the same place; average precision {:.3f}\n", right,
             answers.size(), average_precision(answers));
}

/// Returns the most similar comparable view; its score is relative to that of the previous frame.
std::optional<Answer> answer(const std::vector<View>& views, std::size_t query, bool& answerable) {
  const View& view = views[query];
  if (query == 0 || views[query - 1].sequence != view.sequence) return std::nullopt;
  const double neighbor = similarity(view.bag, views[query - 1].bag);
  Answer best;
  for (const View& other : views) {
    if (!comparable(view, other)) continue;
    const bool right = same_place(view, other);
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
    features->descriptors.assign(view.descriptors.begin(), view.descriptors.end());
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

struct RecallArguments {
  std::vector<std::string> sequences, vocabularies;
};

void run(const RecallArguments& arguments) {
  std::vector<View> views;
  for (std::size_t i = 0; i < arguments.sequences.size(); ++i) {
    auto more = views_of(arguments.sequences[i], i);
    std::move(more.begin(), more.end(), std::back_inserter(views));
  }
  if (views.empty())
    throw Error("no frame has a true pose", arguments.sequences.front(), "check groundtruth.txt");
  if (arguments.vocabularies.empty()) report("", views);
  for (const std::string& file : arguments.vocabularies) report(file, views);
}

}  // namespace

void add_place_recall_command(CLI::App& app) {
  auto arguments = std::make_shared<RecallArguments>();
  CLI::App* command =
      app.add_subcommand("place-recall", "measure precision and recall of place recognition");
  command->add_option("sequences", arguments->sequences, "folders in TUM layout, of one world")
      ->required();
  command->add_option("--vocabulary", arguments->vocabularies,
                      "vocabulary file; may be repeated; default: the built-in one");
  command->callback([arguments] { run(*arguments); });
}

}  // namespace stillmap::lab
