// SPDX-License-Identifier: Apache-2.0
/// Precision of the loop verification. Each sequence (with ground truth) is mapped without loop
/// closing. Then every keyframe is compared with the five places most similar to it outside of its
/// covisible keyframes, without the consistency over three keyframes that loop closing asks for,
/// and is verified with more and more of the tests. A match is right if the true relative pose of
/// the two cameras agrees within 0.1 m and 3 degrees. Printed: right and wrong matches after each
/// test, and the share of the expected landmarks that was found in right and in wrong matches.
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/loop/loop_detector.hpp"
#include "stillmap/loop/loop_verification.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

/// Tests of verify_loop(); each step adds one test to those of the previous steps.
struct Step {
  const char* name;
  LoopVerificationOptions options;
};

std::vector<Step> steps() {
  LoopVerificationOptions options;
  const LoopVerificationOptions all = options;
  options.min_found_share = 0, options.max_blank_share = 1;
  options.drift = {1e9, 0, 1e9, 0};
  options.min_neighbors_agree = 0;
  std::vector<Step> made = {{"landmarks agree on a pose", options}};
  options.min_found_share = all.min_found_share, options.max_blank_share = all.max_blank_share;
  made.push_back({"and the surroundings", options});
  options.min_neighbors_agree = all.min_neighbors_agree;
  made.push_back({"and the neighbors", options});
  made.push_back({"and drift can be the reason", all});
  return made;
}

struct Counts {
  int right = 0, wrong = 0;
};

/// Map with its place index and the true trajectory.
struct Mapped {
  Map map;
  PlaceIndex index{std::make_shared<const Vocabulary>(Vocabulary::built_in())};
  Trajectory truth;

  Pose truth_of(KeyframeId id) const {
    const auto pose = pose_at(truth, map.at(id).timestamp);
    if (!pose) throw Error("no true pose for a keyframe", "", "use a sequence with truth for all");
    return *pose;
  }
};

Mapped map_of(const std::string& sequence) {
  const SequencePaths paths = find_sequence(sequence);
  Prefetch source(std::make_unique<TumFolder>(paths, read_camera(paths.camera.string())));
  SlamParameters options;
  options.places.loops = false;
  options.dense_cloud = false;
  options.final_adjustment = false;
  SlamSystem slam(source.camera(), options);
  while (const auto frame = source.next()) slam.push(frame);
  slam.finish();
  Mapped made{.map = Map(slam.saved_map("").map), .truth = read_trajectory(paths.ground_truth)};
  made.map.for_each_keyframe([&](const Keyframe& k) {
    std::vector<float> weights = k.static_weight;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      if (!k.landmarks[i].valid()) weights[i] = 0;
    }
    made.index.insert(k.id, *k.features, weights);
  });
  return made;
}

/// Returns the places most similar to a keyframe, except its covisible keyframes.
std::vector<PlaceCandidate> alike(const Mapped& mapped, KeyframeId query) {
  std::vector<KeyframeId> surroundings = {query};
  for (const Covisible& c : mapped.map.covisible(query)) surroundings.push_back(c.keyframe);
  std::sort(surroundings.begin(), surroundings.end());
  return find_places(mapped.map, mapped.index, mapped.index.find(query)->words, surroundings, 0,
                     /*island_share=*/0);
}

bool is_right(const Mapped& mapped, const LoopMatch& match) {
  constexpr double kMeters = 0.1, kRadians = 3 * std::numbers::pi / 180;
  const Pose truth = mapped.truth_of(match.candidate).inverse() * mapped.truth_of(match.query);
  const Pose error = truth.inverse() * match.T_candidate_query;
  return error.translation().norm() <= kMeters && error.angle() <= kRadians;
}

class Tally {
 public:
  void add(const Mapped& mapped) {
    std::vector<KeyframeId> keyframes;
    mapped.map.for_each_keyframe([&](const Keyframe& k) { keyframes.push_back(k.id); });
    for (const KeyframeId query : keyframes) {
      for (const PlaceCandidate& place : alike(mapped, query)) judge(mapped, query, place.keyframe);
    }
  }

  void print() const {
    fmt::print("{} candidates\n", candidates_);
    for (std::size_t i = 0; i < steps_.size(); ++i)
      fmt::print("{}: {} right, {} wrong\n", steps_[i].name, counts_[i].right, counts_[i].wrong);
    for (const bool right : {true, false}) {
      const auto& found = found_[right];
      const auto& blank = blank_[right];
      fmt::print(
          "{} matches of the first test: share found {:.2f} to {:.2f}, median {:.2f}; share where "
          "nothing is found {:.2f} to {:.2f}, median {:.2f}\n",
          right ? "right" : "wrong", quantile(found, 0), quantile(found, 1), quantile(found, 0.5),
          quantile(blank, 0), quantile(blank, 1), quantile(blank, 0.5));
    }
  }

 private:
  void judge(const Mapped& mapped, KeyframeId query, KeyframeId candidate) {
    ++candidates_;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const auto verification =
          verify_loop(mapped.map, mapped.index, query, candidate, steps_[i].options);
      if (!verification.match) return;
      const bool right = is_right(mapped, *verification.match);
      right ? ++counts_[i].right : ++counts_[i].wrong;
      if (i > 0) continue;
      found_[right].push_back(verification.match->found_share);
      blank_[right].push_back(verification.match->blank_share);
    }
  }

  const std::vector<Step> steps_ = steps();
  std::vector<Counts> counts_{steps_.size()};
  std::array<std::vector<double>, 2> found_, blank_;  // wrong, right
  int candidates_ = 0;
};

void run(const std::vector<std::string>& sequences) {
  Tally all;
  for (const std::string& sequence : sequences) {
    const Mapped mapped = map_of(sequence);
    Tally one;
    one.add(mapped);
    all.add(mapped);
    fmt::print("{}: {} keyframes, ", sequence, mapped.map.keyframe_count());
    one.print();
  }
  fmt::print("all: ");
  all.print();
}

}  // namespace

void add_loop_precision_command(CLI::App& app) {
  auto sequences = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand(
      "loop-precision", "measure the precision of each test of the loop verification");
  command->add_option("sequences", *sequences, "folders in TUM layout with groundtruth.txt")
      ->required();
  command->callback([sequences] { run(*sequences); });
}

}  // namespace stillmap::lab
