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
  /// Pixels this near to the outline of a mover count neither way: a keypoint's patch covers both
  /// sides there, and masks are a pixel or two off.
  int outline_margin = 6;
  /// A surface that moves faster than this moves [m/s], ...
  double moving_above = 0.02;
  /// ... one that moves at most so fast stands still [m/s]; between the two it counts neither way.
  double still_below = 0.02;
  /// A mover stands still as a whole if no more than this share of its pixels moves.
  double still_share = 0.1;
  /// Where speeds are not known: whether people are taken for still, instead of for moving.
  bool still_people = false;
  /// Keypoints of a kind that a frame must have to count in the means over frames.
  int min_keypoints = 10;
};

/// What a pixel truly shows.
enum class PixelTruth : std::uint8_t {
  kLeftOut,       ///< too near to an outline, or neither clearly moving nor clearly still
  kStatic,        ///< the static world
  kMoving,        ///< part of a mover, and it moves
  kStillPerson,   ///< part of a person who stands still as a whole
  kStaticObject,  ///< part of another mover that stands still as a whole
  kResting,       ///< a part at rest of a mover that moves otherwise: the foot on the floor
};

/// PixelTruth of every pixel, 8UC1.
cv::Mat1b label_pixels(const MotionTruth& truth, const LabelFigureOptions& options);

/// Keypoints of one kind, and how many of them were said to move.
struct LabelTally {
  std::size_t total = 0, said_moving = 0;
  double share() const {  ///< 0 where there are none
    return total == 0 ? 0 : static_cast<double>(said_moving) / static_cast<double>(total);
  }
};

/// Keypoints by what they truly show. Those on resting parts are neither right nor wrong.
struct LabelCounts {
  LabelTally static_world, moving, still_people, still_things, resting;
  std::size_t left_out = 0;          ///< keypoints near outlines, unclear, or off the image
  std::size_t said_moving() const {  ///< of those that are right or wrong
    return static_world.said_moving + moving.said_moving + still_people.said_moving +
           still_things.said_moving;
  }
  /// Of the keypoints said to move, the share that does; 1 where none was said to.
  double precision() const;
  /// Of the keypoints that move, the share said to; 0 where none does.
  double recall() const { return moving.share(); }
};

/// Mean of a figure over those frames that have it.
struct FrameMean {
  double mean = 0;
  std::size_t frames = 0;
};

struct LabelFigures {
  std::size_t frames = 0;                ///< judged
  std::size_t frames_without_truth = 0;  ///< left out
  bool knows_speed = false;  ///< whether the truth says what moves, and not only what can
  LabelCounts pooled;        ///< all keypoints of all frames
  FrameMean precision;       ///< over frames where something moves and something was said to
  FrameMean recall;          ///< over frames where something moves
  FrameMean still_people;    ///< share falsely said to move, over frames with still people
  FrameMean still_things;    ///< the same of other movers
  FrameMean static_world;    ///< the same of the static world, over all frames
};

/// Judges labels frame by frame.
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

/// Judges all frames by the truth beside their sequence. Throws Error where no frame has truth.
LabelFigures evaluate_labels(std::span<const LabeledFrame> frames, const MotionTruthFolder& truth,
                             const LabelFigureOptions& options = {});

/// A few lines of text.
std::string label_text(const LabelFigures& figures);
void to_json(nlohmann::json& json, const LabelFigures& figures);

}  // namespace stillmap
