// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/label_figures.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Value of people in masks.
constexpr int kPerson = 255;
/// A mover is static as a whole if at most this share of its pixels is moving [0..1].
constexpr double kStillShare = 0.1;
/// Number of keypoints of one kind that a frame needs to enter the mean over frames.
constexpr std::size_t kMinKeypoints = 10;

std::uint8_t value(PixelTruth truth) { return static_cast<std::uint8_t>(truth); }

/// Returns the number of the mover of each pixel, 32SC1: its instance, or its connected piece of
/// the mask if there are no instances.
cv::Mat1i movers_of(const MotionTruth& truth) {
  cv::Mat1i movers;
  if (truth.instances.empty()) {
    cv::connectedComponents(truth.mask != 0, movers, 8, CV_32S);
  } else {
    truth.instances.convertTo(movers, CV_32S);
  }
  return movers;
}

/// Returns 255 at pixels within `margin` pixels of an outline of a mover, else 0.
cv::Mat1b near_outlines(const cv::Mat1i& movers, const cv::Mat& mask, int margin) {
  cv::Mat ids, highest, lowest;
  movers.convertTo(ids, CV_16U);
  ids.setTo(0, mask == 0);
  const cv::Mat square =
      cv::getStructuringElement(cv::MORPH_RECT, {2 * margin + 1, 2 * margin + 1});
  cv::dilate(ids, highest, square);
  cv::erode(ids, lowest, square);
  return highest != lowest;
}

/// Returns the share of moving pixels [0..1] of each mover.
std::vector<double> moving_shares(const cv::Mat1i& movers, const cv::Mat1b& moving) {
  double most = 0;
  cv::minMaxLoc(movers, nullptr, &most);
  std::vector<double> pixels(static_cast<std::size_t>(most) + 1), share(pixels.size());
  for (int v = 0; v < movers.rows; ++v) {
    for (int u = 0; u < movers.cols; ++u) {
      const auto mover = static_cast<std::size_t>(movers(v, u));
      ++pixels[mover];
      share[mover] += moving(v, u) != 0;
    }
  }
  for (std::size_t i = 0; i < share.size(); ++i) share[i] /= std::max(1.0, pixels[i]);
  return share;
}

/// Moving and static pixels of the movers, 255 or 0. Pixels of unclear motion are in neither image.
struct MovingAndStill {
  cv::Mat1b moving, still;
};

MovingAndStill split_by_motion(const MotionTruth& truth, const LabelFigureOptions& options) {
  const cv::Mat mover = truth.mask != 0;
  if (!truth.speed.empty()) {
    return {mover & (truth.speed > options.moving_above),
            mover & (truth.speed <= options.still_below)};
  }
  const cv::Mat still = (truth.mask == kPerson) & cv::Scalar(options.still_people ? 255 : 0);
  return {mover & ~still, still};
}

/// Returns the tally of a kind of pixel; null for excluded pixels.
LabelTally* tally_of(PixelTruth truth, LabelCounts& counts) {
  switch (truth) {
    case PixelTruth::kStatic:
      return &counts.static_world;
    case PixelTruth::kMoving:
      return &counts.moving;
    case PixelTruth::kStillPerson:
      return &counts.still_people;
    case PixelTruth::kStaticObject:
      return &counts.still_things;
    case PixelTruth::kResting:
      return &counts.resting;
    case PixelTruth::kLeftOut:
      break;
  }
  return nullptr;
}

LabelCounts count(const LabeledFrame& frame, const cv::Mat1b& labels) {
  LabelCounts counts;
  for (const KeypointLabel& k : frame.keypoints) {
    const int u = static_cast<int>(std::lround(k.u)), v = static_cast<int>(std::lround(k.v));
    const bool inside = u >= 0 && v >= 0 && u < labels.cols && v < labels.rows;
    LabelTally* tally = inside ? tally_of(static_cast<PixelTruth>(labels(v, u)), counts) : nullptr;
    if (tally == nullptr) {
      ++counts.left_out;
      continue;
    }
    ++tally->total;
    if (k.moving()) ++tally->said_moving;
  }
  return counts;
}

void pool(const LabelTally& more, LabelTally& sum) {
  sum.total += more.total;
  sum.said_moving += more.said_moving;
}

void pool(const LabelCounts& more, LabelCounts& sum) {
  pool(more.static_world, sum.static_world);
  pool(more.moving, sum.moving);
  pool(more.still_people, sum.still_people);
  pool(more.still_things, sum.still_things);
  pool(more.resting, sum.resting);
  sum.left_out += more.left_out;
}

void average(double value, FrameMean& mean) {
  ++mean.frames;
  mean.mean += (value - mean.mean) / static_cast<double>(mean.frames);
}

void average_share(const LabelTally& tally, FrameMean& mean) {
  if (tally.total >= kMinKeypoints) average(tally.share(), mean);
}

nlohmann::json json_of(const LabelTally& tally) {
  return {{"keypoints", tally.total},
          {"said_moving", tally.said_moving},
          {"share", tally.total == 0 ? nlohmann::json() : nlohmann::json(tally.share())}};
}

nlohmann::json json_of(const FrameMean& mean) {
  return {{"mean", mean.frames == 0 ? nlohmann::json() : nlohmann::json(mean.mean)},
          {"frames", mean.frames}};
}

std::string mean_text(const FrameMean& mean) {
  return fmt::format("{:.4f} ({})", mean.mean, counted(mean.frames, "frame"));
}

std::string share_line(const char* name, const FrameMean& mean, const LabelTally& tally) {
  if (tally.total == 0) return "";
  const std::string by_frame = mean.frames == 0 ? "-" : mean_text(mean);
  return fmt::format("{:<34}{:>22}{:>10.4f}{:>12}\n", name, by_frame, tally.share(), tally.total);
}

}  // namespace

double LabelCounts::precision() const {
  return said_moving() == 0
             ? 1
             : static_cast<double>(moving.said_moving) / static_cast<double>(said_moving());
}

cv::Mat1b label_pixels(const MotionTruth& truth, const LabelFigureOptions& options) {
  const cv::Mat1i movers = movers_of(truth);
  const cv::Mat1b outlines = near_outlines(movers, truth.mask, options.outline_margin);
  const MovingAndStill known = split_by_motion(truth, options);
  const std::vector<double> shares = moving_shares(movers, known.moving);
  cv::Mat1b labels(truth.mask.size(), value(PixelTruth::kLeftOut));
  for (int v = 0; v < labels.rows; ++v) {
    for (int u = 0; u < labels.cols; ++u) {
      if (outlines(v, u) != 0) continue;
      const int kind = truth.mask.at<std::uint8_t>(v, u);
      if (kind == 0) {
        labels(v, u) = value(PixelTruth::kStatic);
      } else if (known.moving(v, u) != 0) {
        labels(v, u) = value(PixelTruth::kMoving);
      } else if (known.still(v, u) != 0) {
        const bool rests = shares[static_cast<std::size_t>(movers(v, u))] > kStillShare;
        const auto still = kind == kPerson ? PixelTruth::kStillPerson : PixelTruth::kStaticObject;
        labels(v, u) = value(rests ? PixelTruth::kResting : still);
      }
    }
  }
  return labels;
}

LabelCounts LabelEvaluator::add(const LabeledFrame& frame, const MotionTruth& truth) {
  const LabelCounts counts = count(frame, label_pixels(truth, options_));
  pool(counts, figures_.pooled);
  ++figures_.frames;
  figures_.knows_speed |= !truth.speed.empty();
  average_share(counts.moving, figures_.recall);
  if (counts.moving.total >= kMinKeypoints && counts.said_moving() > 0) {
    average(counts.precision(), figures_.precision);
  }
  average_share(counts.still_people, figures_.still_people);
  average_share(counts.still_things, figures_.still_things);
  average_share(counts.static_world, figures_.static_world);
  return counts;
}

LabelFigures evaluate_labels(std::span<const LabeledFrame> frames, const MotionTruthFolder& truth,
                             const LabelFigureOptions& options) {
  LabelEvaluator judge(options);
  for (const LabeledFrame& frame : frames) {
    if (const auto known = truth.at(frame.timestamp)) {
      judge.add(frame, *known);
    } else {
      judge.add_without_truth();
    }
  }
  const LabelFigures figures = judge.figures();
  if (figures.frames == 0) {
    throw Error(fmt::format("none of {} has a true mask", counted(frames.size(), "frame")),
                "motion labels", "check that labels and masks belong to the same sequence");
  }
  return figures;
}

std::string label_text(const LabelFigures& f) {
  std::string text = fmt::format(
      "labels of {} ({} without truth); {}\n", counted(f.frames, "frame"), f.frames_without_truth,
      f.knows_speed ? "truth from measured speeds" : "every movable object counts as moving");
  text += fmt::format("{:<34}{:>22}{:>10}{:>12}\n", "", "mean over frames", "pooled", "keypoints");
  if (f.pooled.moving.total > 0) {
    text += fmt::format("{:<34}{:>22}{:>10.4f}{:>12}\n", "precision of \"moving\"",
                        mean_text(f.precision), f.pooled.precision(), f.pooled.said_moving());
  }
  text += share_line("recall of \"moving\"", f.recall, f.pooled.moving);
  text += share_line("false \"moving\": static world", f.static_world, f.pooled.static_world);
  text += share_line("false \"moving\": static people", f.still_people, f.pooled.still_people);
  text += share_line("false \"moving\": static objects", f.still_things, f.pooled.still_things);
  text += share_line("\"moving\": resting parts of movers", {}, f.pooled.resting);
  return text + fmt::format("excluded keypoints (outlines, unclear): {}\n", f.pooled.left_out);
}

void to_json(nlohmann::json& json, const LabelFigures& f) {
  json = {{"frames", f.frames},
          {"frames_without_truth", f.frames_without_truth},
          {"knows_speed", f.knows_speed},
          {"precision", json_of(f.precision)},
          {"recall", json_of(f.recall)},
          {"false_moving_static_world", json_of(f.static_world)},
          {"false_moving_still_people", json_of(f.still_people)},
          {"false_moving_still_things", json_of(f.still_things)},
          {"pooled",
           {{"precision",
             f.pooled.said_moving() == 0 ? nlohmann::json() : nlohmann::json(f.pooled.precision())},
            {"recall",
             f.pooled.moving.total == 0 ? nlohmann::json() : nlohmann::json(f.pooled.recall())},
            {"moving", json_of(f.pooled.moving)},
            {"static_world", json_of(f.pooled.static_world)},
            {"still_people", json_of(f.pooled.still_people)},
            {"still_things", json_of(f.pooled.still_things)},
            {"resting", json_of(f.pooled.resting)},
            {"left_out", f.pooled.left_out}}}};
}

}  // namespace stillmap
