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

/// Takes cues out of a preset by name.
void leave_out(const std::vector<std::string>& names, const std::string& preset, MotionCues& cues) {
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

MotionEstimator::MotionEstimator(const MotionOptions& options)
    : exclude_below_(options.exclude_below), cues_(make_cues(options)) {
  leave_out(options.without, options.preset, cues_);
}

std::set<std::string> MotionEstimator::classes() const {
  std::set<std::string> names;
  for (const auto& cue : cues_) names.merge(cue->classes());
  return names;
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
