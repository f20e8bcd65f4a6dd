// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/depth_sensor.hpp"

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the depth factor (raw units per meter) that the steps between the raw depths of a
/// structured-light camera show; none for other cameras. Kinect v1 and Xtion measure disparities
/// in eighths of a pixel, so at depth z two neighboring values differ by q z^2 with q = 1 / (8 f b)
/// = 0.0029 / m (f = 580 pixels, b = 0.075 m; Khoshelham and Elberink, Accuracy and Resolution of
/// Kinect Depth Data, Sensors 2012, eq. 6). In raw units r = F z the step is q r^2 / F, so that
/// r^2 / step = F / q at every depth.
/// @param seen   whether a pixel has each raw value; 0 and 65535 are no depths
/// @param sensor other sensors than structured light have other steps: none for them
std::optional<double> depth_factor_of_steps(const std::vector<bool>& seen,
                                            const DepthSensor& sensor);

/// Returns the step between neighboring raw depths if it is the same at all depths, which hardly
/// any sensor has but in steps of its unit: an image of 8 bits that was converted. None for steps
/// that grow with the depth, of fewer than 30 depths, or over less than a factor of 2.
/// @param seen  as for depth_factor_of_steps()
std::optional<double> equal_step(const std::vector<bool>& seen);

/// Evidence of whether the bytes of 16-bit depths were exchanged: most steps between neighboring
/// pixels are then smaller with the bytes exchanged back.
class ByteOrderEvidence {
 public:
  /// @param raw  depths in raw units, 0 where unknown
  void add(const cv::Mat1f& raw);
  std::optional<Finding> finding() const;

 private:
  std::size_t steps_ = 0, smaller_swapped_ = 0;
};

/// Shift and enlargement at which the edges of the depth image meet the strongest color gradients.
struct RegistrationFit {
  std::array<cv::Point, 4> offsets;  ///< of the four quadrants [pixels]
  double gain = 1;                   ///< Mean gradient there, relative to that without offsets.
  double least_gain = 1;             ///< The least of the four quadrants.
};

/// Evidence of whether a depth image was registered to its color image, and shows the same moment:
/// the edges of objects are at the same pixels in both. Collected over some frames, per quadrant of
/// the image, since the offset of an unregistered image differs over the image. Edges where the
/// color image is black or covered tell nothing and do not count.
class RegistrationEvidence {
 public:
  explicit RegistrationEvidence(const DepthSensor& sensor) : sensor_(sensor) {}

  /// Adds a frame; both images have the same size as those before. Frames within half a second tell
  /// whether the depth images fit the color images of another moment.
  /// @param time  [s], ascending
  /// @param depth [m], 0 if unknown
  void add(double time, const cv::Mat1b& gray, const cv::Mat1f& depth);

  /// Returns the shift and the enlargement that fit best, within 24 pixels.
  RegistrationFit fit() const;

  /// Returns whether the depth images are not registered. In registered recordings the gain is at
  /// most 1.18 over 20 frames of fast motion and 1.05 over 120 frames; with depth that is shifted
  /// by 12 pixels or enlarged by a tenth it is 1.25 to 1.36, unless the motion is fast.
  bool contradicts() const;
  /// Returns how the depth images would have to be turned to fit the color images, such as
  /// "mirrored left to right"; empty if they fit best as they are, or if turned edges are no nearer
  /// to edges of the color images than the pixels around them, as in depth that is not registered.
  /// In correct recordings the gradient at turned edges is at most 0.9 of that at the edges.
  std::string turned() const;
  /// Returns the delay of the color images that the depth images fit best [s]: negative if depth
  /// shows what color showed before; 0 if they fit as they are, or at no moment. In correct
  /// recordings the gradient in an image 0.1 s away is at most 0.86 of that in the image itself; if
  /// depth is two or more images late, it is 1.02 to 1.44.
  double delay() const;
  /// Returns whether the edges are no nearer to edges of the color images than any pixel around
  /// them: the depth images are of another place or moment. The gradients at the edges are at least
  /// 1.25 times the mean of those within 24 pixels on right recordings, 1.15 times with depth that
  /// is 20 ms late in fast motion, and at most 1.03 times with depth that is twenty images late.
  bool unrelated() const;
  /// Returns the finding that the depth images are not registered, are mirrored, or show another
  /// moment; none if they seem to be right, and for fewer than 10 frames, which may all be of one
  /// fast motion.
  std::optional<Finding> finding() const;

 private:
  static constexpr int kReach = 24, kStep = 2;  // of the offsets tried [pixels]
  static constexpr int kSide = 2 * kReach / kStep + 1;

  struct Quadrant {
    cv::Mat1d sums = cv::Mat1d::zeros(kSide, kSide);  // of gradients at the edges, by offset
    std::size_t edges = 0;
  };
  /// A frame to compare the next ones with.
  struct Recent {
    double time = 0;
    cv::Mat1f gradient, around;    // around: mean gradient within kReach
    std::vector<cv::Point> edges;  // of depth
    double own = 0;                // sum of the gradients at the edges
  };
  /// Depth edges in color images of another moment.
  struct Lag {
    double seconds = 0;             // sum of the delays of color
    double gradients = 0, own = 0;  // sums, there and in the color images of the depth images
    double around = 0;              // sum of the mean gradients around the edges, there
    std::size_t frames = 0, edges = 0;
    void add(const Recent& depth, const Recent& color);
  };
  static constexpr std::size_t kLags = 4;  // frames back and ahead
  void compare_with_recent(Recent frame);
  std::size_t edges() const;  // of all quadrants

  DepthSensor sensor_;
  std::size_t frames_ = 0;
  std::array<Quadrant, 4> quadrants_;
  std::deque<Recent> recent_;              // newest first
  std::array<Lag, kLags> ahead_, back_;    // for color images of later, and of earlier frames
  std::array<double, 4> turned_{};         // sums of the gradients at the edges by kTurns
  std::array<double, 4> around_turned_{};  // sums of the mean gradients around them
  std::size_t turned_edges_ = 0;           // number of edges in these sums
};

}  // namespace stillmap
