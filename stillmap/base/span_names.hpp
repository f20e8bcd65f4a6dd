// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <string_view>

/// Names of the trace spans from which the timing of a run is made. The code that opens such a span
/// and the code that reads its time use the same constant. Spans that only a profile shows are
/// named where they are opened.
namespace stillmap::span {

// Spans of the thread that pushes frames.
inline constexpr std::string_view kFrame = "frame";
inline constexpr std::string_view kFeatures = "features";
inline constexpr std::string_view kInitialPose = "initial pose";
inline constexpr std::string_view kCells = "cells";
inline constexpr std::string_view kMotionBeforeMasks = "motion before masks";
inline constexpr std::string_view kMotion = "motion";
inline constexpr std::string_view kPose = "pose";
inline constexpr std::string_view kWaitingForMap = "waiting for map";

// Spans of the other threads.
inline constexpr std::string_view kMaskPropagation = "mask propagation";
inline constexpr std::string_view kSegmentation = "segmentation";
inline constexpr std::string_view kKeyframeInsertion = "keyframe insertion";
inline constexpr std::string_view kMapRefinement = "map refinement";
inline constexpr std::string_view kPlaceRecognition = "place recognition";
inline constexpr std::string_view kLoopClosing = "loop closing";
inline constexpr std::string_view kRelocalization = "relocalization";
inline constexpr std::string_view kGlobalAdjustment = "global adjustment";
inline constexpr std::string_view kApplyingGlobalAdjustment = "applying global adjustment";
inline constexpr std::string_view kFinalMerging = "final merging";
inline constexpr std::string_view kFinalAdjustment = "final adjustment";
inline constexpr std::string_view kDenseLabels = "dense map: labels";
inline constexpr std::string_view kDenseKeyframe = "dense map: keyframe";
inline constexpr std::string_view kDenseOtherFrame = "dense map: other frame";
inline constexpr std::string_view kDenseCorrected = "dense map: corrected";
inline constexpr std::string_view kDenseComposition = "dense composition";
inline constexpr std::string_view kMovers = "movers";

/// Spans of the other threads in the order in which the timing of a run lists them.
inline constexpr std::array kStages = {kMaskPropagation,
                                       kSegmentation,
                                       kKeyframeInsertion,
                                       kMapRefinement,
                                       kPlaceRecognition,
                                       kLoopClosing,
                                       kRelocalization,
                                       kGlobalAdjustment,
                                       kApplyingGlobalAdjustment,
                                       kFinalMerging,
                                       kFinalAdjustment,
                                       kDenseLabels,
                                       kDenseKeyframe,
                                       kDenseOtherFrame,
                                       kDenseCorrected,
                                       kDenseComposition,
                                       kMovers};

}  // namespace stillmap::span
