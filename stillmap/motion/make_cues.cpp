// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/make_cues.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/motion/motion_estimator.hpp"

#include <algorithm>
#include <map>
#include <string>

namespace stillmap {
namespace {

using MakeCue = std::unique_ptr<MotionCue> (*)(const MotionOptions&);

/// Returns a cue with its member of the options.
template <typename Cue, auto Member>
std::unique_ptr<MotionCue> make(const MotionOptions& options) {
  return std::make_unique<Cue>(options.*Member);
}

template <typename Cue>
std::unique_ptr<MotionCue> make(const MotionOptions&) {
  return std::make_unique<Cue>();
}

std::unique_ptr<MotionCue> make_gated_semantic(const MotionOptions& options) {
  return std::make_unique<GatedCue>(options.gate, std::make_unique<SemanticCue>(options.semantic));
}

std::unique_ptr<MotionCue> make_epipolar_everywhere(const MotionOptions& options) {
  EpipolarOptions everywhere = options.epipolar;
  everywhere.everywhere = true;
  return std::make_unique<EpipolarCue>(everywhere);
}

const std::map<std::string, MakeCue>& cue_makers() {
  static const std::map<std::string, MakeCue> all = {
      {"residual", make<ResidualCue>},
      {"free-space", make<FreeSpaceCue>},
      {"surface", make<SurfaceCue>},
      {"history", make<HistoryCue>},
      {"semantic", make<SemanticCue, &MotionOptions::semantic>},
      {"box-flow", make<BoxFlowCue, &MotionOptions::box_flow>},
      {"gated-semantic", make_gated_semantic},
      {"epipolar", make<EpipolarCue, &MotionOptions::epipolar>},
      {"epipolar-everywhere", make_epipolar_everywhere},
  };
  return all;
}

MakeCue find_maker(const std::string& name) {
  const auto& makers = cue_makers();
  if (const auto found = makers.find(name); found != makers.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, maker] : makers) names.push_back(known);
  throw Error("there is no motion cue '" + name + "'", "motion.cues", suggestion(name, names));
}

}  // namespace

MotionCues make_cues(const MotionOptions& options) {
  MotionCues cues;
  for (const std::string& name : options.cues) cues.push_back(find_maker(name)(options));
  return cues;
}

bool use_instances(const MotionCues& cues) {
  return std::any_of(cues.begin(), cues.end(),
                     [](const auto& cue) { return !cue->classes().empty(); });
}

}  // namespace stillmap
