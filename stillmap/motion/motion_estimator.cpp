// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/motion_estimator.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/base/stopwatch.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Even odds (nothing is known) count in full; from there the weight falls with the probability.
float residual_weight(float static_log_odds, double exclude_below) {
  const float p = static_probability(static_log_odds);
  return p < exclude_below ? 0.0f : std::min(1.0f, 2 * p);
}

using Cues = std::vector<std::unique_ptr<MotionCue>>;

/// Takes cues out of a preset by name.
void leave_out(const std::vector<std::string>& names, const std::string& preset, Cues& cues) {
  std::vector<std::string> known;
  for (const auto& cue : cues) known.emplace_back(cue->name());
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw Error("preset '" + preset + "' has no cue '" + name + "'", "motion.without",
                  known.empty() ? "it has no cues at all" : suggestion(name, known));
    }
    std::erase_if(cues, [&](const auto& cue) { return cue->name() == name; });
  }
}

}  // namespace

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"seg-mask", "drop keypoints inside the masks of people (SLAM3-YOLOv8)", true},
      {"static", "take the whole world for static: plain RGB-D SLAM, the baseline", false},
  };
  return all;
}

const Preset& find_preset(const std::string& name) {
  const auto& all = presets();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.name == name; });
  if (found != all.end()) return *found;
  std::vector<std::string> names;
  for (const Preset& preset : all) names.push_back(preset.name);
  throw Error("there is no preset '" + name + "'", "--preset", suggestion(name, names));
}

MotionEstimator::MotionEstimator(const MotionOptions& options)
    : exclude_below_(options.exclude_below) {
  const Preset& preset = find_preset(options.preset);
  if (preset.name == "seg-mask") cues_.push_back(std::make_unique<SemanticCue>(options.semantic));
  leave_out(options.without, preset.name, cues_);
}

MotionEvidence MotionEstimator::estimate(const MotionInput& input) {
  MotionEvidence evidence;
  evidence.static_log_odds.assign(input.features->size(), 0.0f);
  timing_.clear();
  Stopwatch watch;
  for (const auto& cue : cues_) {
    cue->add_to(evidence, input);
    timing_.push_back({std::string(cue->name()), watch.lap()});
  }
  evidence.weight.reserve(evidence.static_log_odds.size());
  for (const float log_odds : evidence.static_log_odds) {
    evidence.weight.push_back(residual_weight(log_odds, exclude_below_));
  }
  return evidence;
}

}  // namespace stillmap
