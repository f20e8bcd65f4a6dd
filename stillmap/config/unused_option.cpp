// SPDX-License-Identifier: Apache-2.0
#include "stillmap/config/unused_option.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <string_view>
#include <vector>

namespace stillmap {
namespace {

/// Options that have an effect only under a condition.
struct Condition {
  std::vector<std::string_view> options;  // paths; "group." stands for all of a group
  std::function<bool(const Options&)> met;
  std::string otherwise;  // reason and advice if it is not met
};

std::function<bool(const Options&)> has_cue(std::vector<std::string_view> names) {
  return [names = std::move(names)](const Options& options) {
    return std::any_of(names.begin(), names.end(), [&](std::string_view name) {
      const auto& cues = options.motion.cues;
      return std::find(cues.begin(), cues.end(), name) != cues.end();
    });
  };
}

std::string no_cue(const std::string& names) {
  return "motion.cues has no " + names + "; choose the preset that uses it";
}

const std::vector<Condition>& conditions() {
  static const std::vector<Condition> all{
      {{"network.mask_delay", "network.max_mask_age"},
       [](const Options& o) { return !o.network.model.empty() || !o.network.masks.empty(); },
       "there are no masks; name a network with --model, or a folder with --masks"},
      {{"network.backend", "network.device", "network.threads", "network.confidence",
        "network.every"},
       [](const Options& o) { return !o.network.model.empty() && o.network.masks.empty(); },
       "there is no network, or a folder of masks is used instead; name one with --model alone"},
      {{"network.model"},
       [](const Options& o) { return o.network.model.empty() || o.network.masks.empty(); },
       "the folder of masks is used instead; leave out one of the two"},
      {{"motion.semantic_prior"}, has_cue({"semantic"}), no_cue("cue semantic")},
      {{"motion.potential_classes"},
       has_cue({"box-flow", "epipolar"}),
       no_cue("cue box-flow or epipolar")},
      {{"motion.box_flow_threshold", "motion.box_flow_body"},
       has_cue({"box-flow"}),
       no_cue("cue box-flow")},
      {{"motion.gate_transform", "motion.gate_warp_error", "motion.gate_marked_share"},
       has_cue({"gated-semantic"}),
       no_cue("cue gated-semantic")},
      {{"motion.epipolar_threshold"},
       has_cue({"epipolar", "epipolar-everywhere"}),
       no_cue("cue epipolar")},
      {{"dense.voxel", "dense.stride", "dense.max_depth", "dense.far_sigma", "dense.every",
        "dense.method", "dense.outlier_deviations", "dense.mask_dilation", "dense.excluded_classes",
        "outputs."},
       [](const Options& o) { return o.dense.enabled; },
       "dense.enabled is false, so there is no dense map"},
      {{"schedule.insert_delay", "schedule.refine_delay"},
       [](const Options& o) { return !o.realtime(); },
       "it is for the schedule lockstep; leave out --schedule realtime"},
  };
  return all;
}

}  // namespace

std::optional<std::string> why_unused(const std::string& path, const Options& options) {
  for (const Condition& condition : conditions()) {
    const bool concerned =
        std::any_of(condition.options.begin(), condition.options.end(), [&](std::string_view name) {
          return name == path || (name.ends_with('.') && path.starts_with(name));
        });
    if (concerned && !condition.met(options)) return condition.otherwise;
  }
  return std::nullopt;
}

}  // namespace stillmap
