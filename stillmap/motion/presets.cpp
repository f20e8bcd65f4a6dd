// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/presets.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/motion/motion_estimator.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// A preset and the list of cues that it is.
struct Recipe {
  Preset preset;
  MotionCues (*cues)(const MotionOptions&);
};

template <typename... Cue>
MotionCues list(std::unique_ptr<Cue>... cues) {
  MotionCues all;
  (all.push_back(std::move(cues)), ...);
  return all;
}

const std::vector<Recipe>& recipes() {
  static const std::vector<Recipe> all = {
      {{"fused",
        "weigh every keypoint by all that is known: its motion against the camera's, free space, "
        "history, and what a network sees",
        true, "any, or none"},
       [](const MotionOptions& o) {
         return list(
             std::make_unique<ResidualCue>(o.residual),
             std::make_unique<FreeSpaceCue>(o.free_space), std::make_unique<SurfaceCue>(o.surface),
             std::make_unique<HistoryCue>(o.history), std::make_unique<SemanticCue>(o.semantic));
       }},
      {{"static", "take the whole world for static: plain RGB-D SLAM, the baseline", false},
       [](const MotionOptions&) { return MotionCues(); }},
      {{"seg-mask", "drop keypoints inside the masks of people (SLAM3-YOLOv8)", true,
        "YOLOv8n-seg, or any that gives masks"},
       [](const MotionOptions& o) { return list(std::make_unique<SemanticCue>(o.semantic)); }},
      {{"box-flow",
        "drop keypoints in boxes of people, animals and vehicles whose optical flow is not the "
        "background's (YOLO11n and Lucas-Kanade)",
        true, "YOLO11n, or any that gives boxes"},
       [](const MotionOptions& o) { return list(std::make_unique<BoxFlowCue>(o.box_flow)); }},
      {{"gated-seg",
        "drop keypoints inside the masks of people only while much of the picture moves (high/low "
        "dynamics)",
        true, "YOLOv8n-seg, or any that gives masks"},
       [](const MotionOptions& o) {
         return list(std::make_unique<GatedCue>(o.gate, std::make_unique<SemanticCue>(o.semantic)));
       }},
      {{"box-epipolar",
        "drop keypoints in boxes of people, animals and vehicles, and elsewhere those off their "
        "epipolar line (improved YOLOv7)",
        true, "YOLOv7, or any that gives boxes"},
       [](const MotionOptions& o) { return list(std::make_unique<EpipolarCue>(o.epipolar)); }},
  };
  return all;
}

const Recipe& find_recipe(const std::string& name) {
  const auto& all = recipes();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& r) { return r.preset.name == name; });
  if (found != all.end()) return *found;
  std::vector<std::string> names;
  for (const Recipe& recipe : all) names.push_back(recipe.preset.name);
  throw Error("there is no preset '" + name + "'", "--preset", suggestion(name, names));
}

}  // namespace

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = [] {
    std::vector<Preset> named;
    for (const Recipe& recipe : recipes()) named.push_back(recipe.preset);
    return named;
  }();
  return all;
}

std::string describe_presets() {
  std::string lines;
  for (const Preset& preset : presets()) {
    lines += fmt::format("  {:<13} {}", preset.name, preset.description);
    if (preset.wants_instances) lines += "; network: " + preset.detector;
    lines += '\n';
  }
  return lines;
}

const Preset& find_preset(const std::string& name) { return find_recipe(name).preset; }

MotionCues make_cues(const MotionOptions& options) {
  return find_recipe(options.preset).cues(options);
}

}  // namespace stillmap
