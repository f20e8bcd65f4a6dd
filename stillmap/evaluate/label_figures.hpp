// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/motion_labels.hpp"
#include "stillmap/evaluate/motion_truth.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

struct LabelFigureOptions {
  /// Width of the band on both sides of a mover's outline in which pixels are excluded: a
  /// keypoint's patch covers both sides there, and masks are one or two pixels off [pixels].
  int outline_margin = 6;
  /// Surfaces with a higher speed are moving [m/s].
  double moving_above = 0.02;
  /// Surfaces with this speed or less are static [m/s]. Speeds between the two are excluded.
  double still_below = 0.02;
  /// Treats people as static instead of moving if the speeds are unknown.
  bool still_people = false;
};

/// Ground truth of one pixel.
enum class PixelTruth : std::uint8_t {
  kLeftOut,       ///< Excluded: near an outline, or neither clearly moving nor clearly static.
  kStatic,        ///< Static world.
  kMoving,        ///< Moving part of a mover.
  kStillPerson,   ///< Part of a person who is static as a whole.
  kStaticObject,  ///< Part of another mover that is static as a whole.
  kResting,       ///< Resting part of a moving mover, such as the foot on the floor.
};

/// Returns the PixelTruth of every pixel, 8UC1.
cv::Mat1b label_pixels(const MotionTruth& truth, const LabelFigureOptions& options);

/// Number of keypoints of one kind, and number of those labeled as moving.
struct LabelTally {
  std::size_t total = 0, said_moving = 0;
  /// Returns the share of keypoints labeled as moving [0..1]; 0 without keypoints.
  double share() const {
    return total == 0 ? 0 : static_cast<double>(said_moving) / static_cast<double>(total);
  }
};

/// Keypoints by ground truth. Labels on resting parts count neither as correct nor as wrong.
struct LabelCounts {
  LabelTally static_world, moving, still_people, still_things, resting;
  std::size_t left_out = 0;  ///< Number of keypoints near outlines, unclear, or outside the image.
  /// Returns the number of keypoints labeled as moving, except those on resting parts.
  std::size_t said_moving() const {
    return static_world.said_moving + moving.said_moving + still_people.said_moving +
           still_things.said_moving;
  }
  /// Returns the share of the keypoints labeled as moving that move [0..1]; 1 if there are none.
  double precision() const;
  /// Returns the share of the moving keypoints that are labeled as moving [0..1]; 0 if there are
  /// none.
  double recall() const { return moving.share(); }
};

/// Mean of a figure over the frames that have it and at least ten keypoints of its kind.
struct FrameMean {
  double mean = 0;
  std::size_t frames = 0;
};

struct LabelFigures {
  std::size_t frames = 0;                ///< Number of evaluated frames.
  std::size_t frames_without_truth = 0;  ///< Number of frames without ground truth.
  bool knows_speed = false;  ///< The truth contains speeds, not only masks of movable objects.
  LabelCounts pooled;        ///< Counts over all keypoints of all frames.
  FrameMean precision;  ///< Mean precision over frames with moving keypoints and labels "moving".
  FrameMean recall;     ///< Mean recall over frames with moving keypoints.
  FrameMean still_people;  ///< Mean share of false labels "moving" on static people.
  FrameMean still_things;  ///< Mean share of false labels "moving" on other static movers.
  FrameMean static_world;  ///< Mean share of false labels "moving" on the static world.
};

/// Evaluates motion labels frame by frame.
class LabelEvaluator {
 public:
  explicit LabelEvaluator(const LabelFigureOptions& options = {}) : options_(options) {}
  LabelCounts add(const LabeledFrame& frame, const MotionTruth& truth);
  void add_without_truth() { ++figures_.frames_without_truth; }
  LabelFigures figures() const { return figures_; }

 private:
  LabelFigureOptions options_;
  LabelFigures figures_;
};

/// Evaluates all frames with the ground truth of their sequence. Throws Error if no frame has
/// ground truth.
LabelFigures evaluate_labels(std::span<const LabeledFrame> frames, const MotionTruthFolder& truth,
                             const LabelFigureOptions& options = {});

/// Returns the figures as a few lines of text.
std::string label_text(const LabelFigures& figures);
void to_json(nlohmann::json& json, const LabelFigures& figures);

}  // namespace stillmap
