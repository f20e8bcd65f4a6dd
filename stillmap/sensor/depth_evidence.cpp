// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/depth_evidence.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr double kStepPerSquare = 0.0029;  // q [1/m]
/// Smallest step whose rounding to whole raw units leaves its size known to some percent.
constexpr std::size_t kLeastStep = 4;
constexpr std::size_t kTooFar = 65535;  // raw depth of pixels without depth
constexpr std::size_t kLeastSteps = 40;
/// Largest ratio of the quartiles of r^2 / step; of a Kinect it is below 1.1.
constexpr double kLargestSpread = 1.2;
/// Common depth factors, and the largest relative difference from them.
constexpr std::array kCommonFactors{1000.0, 5000.0, 10000.0, 2000.0, 4000.0, 100.0};
constexpr double kTolerance = 0.06;

/// Depth jump at an edge of an object, relative to the nearer depth, and in standard deviations of
/// the farther depth.
constexpr float kJump = 0.06F;
constexpr double kJumpSigmas = 8;
/// Gradients are bounded, in units of the image's mean, so that a few do not decide.
constexpr double kLargestGradient = 6;
constexpr std::size_t kLeastEdges = 2000, kLeastFrames = 10;
/// Mean gradient around a pixel, relative to that of the image, below which color shows nothing
/// there: a covered lens, or black.
constexpr float kBlind = 0.02F;
/// Gain and offset [pixels] from which a fit contradicts the registration.
constexpr double kLeastGain = 1.22;
/// Gain below which a quadrant contradicts an offset: 0.95 and more in unregistered recordings.
constexpr double kLeastQuadrantGain = 0.9;
constexpr int kLeastOffset = 4;

/// Ways in which depth images are found turned; the first is as they are.
constexpr std::array kTurns{"as they are", "mirrored left to right", "upside down",
                            "turned by 180 degrees"};
/// Least gain of a turned depth image.
constexpr double kTurnedGain = 1.15;
/// Least gain of the color images of another moment, and the longest time to it [s].
constexpr double kDelayGain = 1.05, kLongestDelay = 0.5;
/// Gradient at the edges, relative to the mean around them, below which images count as unrelated,
/// and from which turned images or images of another moment count as found. In 20 frames of fast
/// motion it is at least 1.14 in the right image and at most 1.04 in wrong ones.
constexpr double kUnrelatedGain = 1.06, kFoundGain = 1.08;
/// Frames from which images may count as unrelated: in 14 frames of a turn by 90 degrees per second
/// the gradient is 1.05 in the right image.
constexpr std::size_t kLeastUnrelatedFrames = 20;

/// Returns the pixels that are nearer or farther than their right or lower neighbor by a jump,
/// which noise does not explain.
std::vector<cv::Point> edges_of(const cv::Mat1f& depth, int margin, const DepthSensor& sensor) {
  const auto noise = sensor.tolerance<float>(kJumpSigmas, 0);
  const auto is_jump = [&](float a, float b) {
    const auto [nearer, farther] = std::minmax(a, b);
    return nearer > 0 && farther - nearer > std::max(kJump * nearer, noise.at(farther));
  };
  std::vector<cv::Point> edges;
  for (int y = margin; y < depth.rows - margin; ++y) {
    for (int x = margin; x < depth.cols - margin; ++x) {
      if (is_jump(depth(y, x), depth(y, x + 1)) || is_jump(depth(y, x), depth(y + 1, x)))
        edges.emplace_back(x, y);
    }
  }
  return edges;
}

/// Returns the bounded magnitude of the gradient, relative to the mean of the image.
cv::Mat1f relative_gradient(const cv::Mat1b& gray) {
  cv::Mat1f dx, dy, magnitude;
  cv::Sobel(gray, dx, CV_32F, 1, 0);
  cv::Sobel(gray, dy, CV_32F, 0, 1);
  cv::magnitude(dx, dy, magnitude);
  magnitude /= std::max(1e-6, cv::mean(magnitude)[0]);
  return cv::min(magnitude, kLargestGradient);
}

/// Returns the mean of an image within `reach` pixels of each pixel.
cv::Mat1f mean_around(const cv::Mat1f& image, int reach) {
  cv::Mat1f mean;
  cv::blur(image, mean, {2 * reach + 1, 2 * reach + 1});
  return mean;
}

double sum_at(const std::vector<cv::Point>& pixels, const cv::Mat1f& image) {
  double sum = 0;
  for (const cv::Point pixel : pixels) sum += image(pixel);
  return sum;
}

}  // namespace

std::optional<double> depth_factor_of_steps(const std::vector<bool>& seen,
                                            const DepthSensor& sensor) {
  if (sensor.principle != DepthPrinciple::kStructuredLight) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t raw = 1, last = 0; raw < std::min(seen.size(), kTooFar); ++raw) {
    if (!seen[raw]) continue;
    if (last > 0 && raw - last >= kLeastStep) {
      const double r = static_cast<double>(raw + last) / 2;
      ratios.push_back(r * r / static_cast<double>(raw - last));
    }
    last = raw;
  }
  if (ratios.size() < kLeastSteps) return std::nullopt;
  const auto quantile = [&](std::size_t part) {
    return value_of_rank(ratios, part * (ratios.size() - 1) / 4);
  };
  if (quantile(3) > kLargestSpread * quantile(1)) return std::nullopt;
  const double factor = kStepPerSquare * quantile(2);
  for (const double common : kCommonFactors) {
    if (std::abs(factor / common - 1) < kTolerance) return common;
  }
  return std::nullopt;
}

std::optional<double> equal_step(const std::vector<bool>& seen) {
  constexpr std::size_t kFewest = 30, kRounding = 1;  // steps, raw units
  constexpr double kLeastRange = 2;                   // largest by smallest depth
  std::vector<std::size_t> steps;
  std::size_t nearest = 0, last = 0;
  for (std::size_t raw = 1; raw < std::min(seen.size(), kTooFar); ++raw) {
    if (!seen[raw]) continue;
    if (last > 0) steps.push_back(raw - last);
    if (nearest == 0) nearest = raw;
    last = raw;
  }
  if (steps.size() < kFewest ||
      static_cast<double>(last) < kLeastRange * static_cast<double>(nearest))
    return std::nullopt;
  // A depth that was not seen makes one step of two.
  std::sort(steps.begin(), steps.end());
  const std::size_t median = steps[steps.size() / 2];
  if (median > steps.front() + kRounding) return std::nullopt;
  const auto range = static_cast<double>(last - nearest);
  return range / std::round(range / static_cast<double>(median));
}

void ByteOrderEvidence::add(const cv::Mat1f& raw) {
  constexpr int kStride = 4;  // rows
  const auto swapped = [](int value) { return (value & 0xFF) << 8 | value >> 8; };
  for (int y = 0; y < raw.rows; y += kStride) {
    const float* row = raw[y];
    for (int x = 1; x < raw.cols; ++x) {
      if (row[x - 1] <= 0 || row[x] <= 0 || row[x - 1] > kTooFar || row[x] > kTooFar) continue;
      const int a = cvRound(row[x - 1]), b = cvRound(row[x]);
      const bool of_eight_bits = (a & 0xFF) == 0 && (b & 0xFF) == 0;
      if (a == b || of_eight_bits) continue;
      ++steps_;
      if (std::abs(swapped(a) - swapped(b)) < std::abs(a - b)) ++smaller_swapped_;
    }
  }
}

std::optional<Finding> ByteOrderEvidence::finding() const {
  constexpr std::size_t kFewest = 5000;
  constexpr double kMost = 0.6;  // share; 0.001 in right recordings, 0.99 in exchanged ones
  if (steps_ < kFewest ||
      static_cast<double>(smaller_swapped_) < kMost * static_cast<double>(steps_))
    return std::nullopt;
  return make_finding("depth-bytes",
                      "the depth images are smoother if the bytes of their 16-bit numbers are "
                      "exchanged",
                      "write PNG with the high byte first, as PNG requires: image.byteswap()");
}

void RegistrationEvidence::Lag::add(const Recent& depth, const Recent& color) {
  if (std::abs(color.time - depth.time) > kLongestDelay) return;
  seconds += color.time - depth.time;
  gradients += sum_at(depth.edges, color.gradient);
  around += sum_at(depth.edges, color.around);
  own += depth.own;
  edges += depth.edges.size();
  ++frames;
}

void RegistrationEvidence::compare_with_recent(Recent frame) {
  for (std::size_t i = 0; i < recent_.size(); ++i) {
    ahead_[i].add(recent_[i], frame);
    back_[i].add(frame, recent_[i]);
  }
  if (recent_.size() == kLags) recent_.pop_back();
  recent_.push_front(std::move(frame));
}

void RegistrationEvidence::add(double time, const cv::Mat1b& gray, const cv::Mat1f& depth) {
  ++frames_;
  const cv::Mat1f gradient = relative_gradient(gray);
  const cv::Mat1f around = mean_around(gradient, kReach);
  const auto is_blind = [&](cv::Point pixel) { return around(pixel) < kBlind; };
  std::vector<cv::Point> depth_edges = edges_of(depth, kReach, sensor_);
  std::erase_if(depth_edges, is_blind);
  compare_with_recent({time, gradient, around, depth_edges, sum_at(depth_edges, gradient)});
  for (const cv::Point edge : depth_edges) {
    const int quadrant = (2 * edge.y >= depth.rows ? 2 : 0) + (2 * edge.x >= depth.cols ? 1 : 0);
    auto& [sums, edges] = quadrants_[static_cast<std::size_t>(quadrant)];
    ++edges;
    const int x = depth.cols - 1 - edge.x, y = depth.rows - 1 - edge.y;  // mirrored
    const std::array<cv::Point, 4> turns{edge, {x, edge.y}, {edge.x, y}, {x, y}};
    if (std::none_of(turns.begin(), turns.end(), is_blind)) {
      ++turned_edges_;
      for (std::size_t i = 0; i < turns.size(); ++i) {
        turned_[i] += gradient(turns[i]);
        around_turned_[i] += around(turns[i]);
      }
    }
    for (int row = 0; row < kSide; ++row) {
      const float* in = gradient[edge.y + row * kStep - kReach] + edge.x - kReach;
      double* sum = sums[row];
      for (int column = 0; column < kSide; ++column) sum[column] += in[column * kStep];
    }
  }
}

RegistrationFit RegistrationEvidence::fit() const {
  constexpr int kCenter = kReach / kStep;
  std::array<cv::Mat1d, 4> smooth;
  double as_they_are = 0;
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    cv::GaussianBlur(quadrants_[i].sums, smooth[i], {3, 3}, 0);
    as_they_are += smooth[i](kCenter, kCenter);
  }
  RegistrationFit best;
  const auto consider = [&](int x, int y, int enlarged) {
    double gradients = 0;
    RegistrationFit fit;
    fit.least_gain = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      const cv::Point outward(i % 2 == 0 ? -1 : 1, i < 2 ? -1 : 1);
      const cv::Point at(x + outward.x * enlarged, y + outward.y * enlarged * 3 / 4);
      if (std::max(std::abs(at.x), std::abs(at.y)) > kCenter) return;
      const double there = smooth[i](kCenter + at.y, kCenter + at.x);
      gradients += there;
      fit.least_gain = std::min(fit.least_gain, there / smooth[i](kCenter, kCenter));
      fit.offsets[i] = at * kStep;
    }
    fit.gain = gradients / as_they_are;
    if (fit.gain > best.gain) best = fit;
  };
  if (as_they_are <= 0) return best;
  for (int enlarged = -kCenter; enlarged <= kCenter; ++enlarged) {
    for (int y = -kCenter; y <= kCenter; ++y) {
      for (int x = -kCenter; x <= kCenter; ++x) consider(x, y, enlarged);
    }
  }
  return best;
}

bool RegistrationEvidence::contradicts() const {
  if (edges() < 4 * kLeastEdges) return false;
  const RegistrationFit best = fit();
  int most = 0;
  for (const cv::Point offset : best.offsets)
    most = std::max({most, std::abs(offset.x), std::abs(offset.y)});
  // An offset at the limit of the search is no finding.
  return best.gain >= kLeastGain && best.least_gain >= kLeastQuadrantGain && most >= kLeastOffset &&
         most < kReach;
}

std::size_t RegistrationEvidence::edges() const {
  std::size_t edges = 0;
  for (const Quadrant& quadrant : quadrants_) edges += quadrant.edges;
  return edges;
}

bool RegistrationEvidence::unrelated() const {
  if (edges() < 4 * kLeastEdges || frames_ < kLeastUnrelatedFrames) return false;
  double at_edges = 0, around = 0;
  for (const Quadrant& quadrant : quadrants_) {
    at_edges += quadrant.sums(kSide / 2, kSide / 2);
    around += cv::mean(quadrant.sums)[0];
  }
  return at_edges < kUnrelatedGain * around;
}

std::string RegistrationEvidence::turned() const {
  const auto best = std::max_element(turned_.begin(), turned_.end());
  if (turned_edges_ < kLeastEdges || *best < kTurnedGain * turned_[0]) return "";
  const auto turn = static_cast<std::size_t>(best - turned_.begin());
  return *best < kFoundGain * around_turned_[turn] ? "" : kTurns[turn];
}

double RegistrationEvidence::delay() const {
  double most = kDelayGain, delay = 0;
  for (const auto& lags : {ahead_, back_}) {
    for (const Lag& lag : lags) {
      if (lag.edges < kLeastEdges || lag.gradients < most * lag.own) continue;
      if (lag.gradients < kFoundGain * lag.around) continue;
      most = lag.gradients / lag.own;
      delay = lag.seconds / static_cast<double>(lag.frames);
    }
  }
  return delay;
}

std::optional<Finding> RegistrationEvidence::finding() const {
  if (frames_ < kLeastFrames) return std::nullopt;
  const std::string edges = "the edges of objects in the depth images ";
  if (const std::string how = turned(); !how.empty()) {
    return make_finding(
        "depth-turned",
        edges + "fit those in the color images better if the depth images are " + how,
        "write color and depth with the same orientation");
  }
  if (const double delay = this->delay(); delay != 0) {
    return make_finding(
        "depth-late",
        fmt::format("{}fit those in the color images of about {:.2f} s {} better: depth and color "
                    "of a frame do not show the same moment",
                    edges, std::abs(delay), delay > 0 ? "later" : "earlier"),
        "correct the timestamps, or the file that pairs the images", {{"delay_s", delay}});
  }
  if (!contradicts()) {
    if (!unrelated()) return std::nullopt;
    return make_finding(
        "depth-unrelated",
        edges +
            "are not where those in the color images are, nor at any small offset: the "
            "depth images are not registered to color, or of another moment or recording",
        "correct the timestamps or the file that pairs the images, or register depth to color");
  }
  std::string text;
  for (const cv::Point offset : fit().offsets)
    text += fmt::format("{}({}, {})", text.empty() ? "" : ", ", offset.x, offset.y);
  return make_finding(
      "depth-unregistered",
      fmt::format("{}are not where those in the color images are: offsets {} pixels in the four "
                  "quarters of the image; the depth seems not to be registered to the color camera",
                  edges, text),
      "record depth that is registered (aligned) to color; see docs/cameras.md");
}

}  // namespace stillmap
