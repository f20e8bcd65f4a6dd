// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/image_agreement.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/optimize/residual.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Number of blocks along a row of the image.
constexpr int kBlocks = 80;
/// Standard deviation of the smoothing of the images, relative to the width of a block.
constexpr double kSmoothing = 0.2;
/// Scale of a difference of brightness [gray levels].
constexpr double kBrightnessScale = 8;
/// Scale of a difference of depths: a factor of the standard deviation of one, and a part [m].
constexpr double kDepthSigmas = 1.5, kDepthFloor = 4e-3;
/// Largest differences of depths of one surface, and of neighbors that are not an edge [scales].
constexpr double kSameSurface = 2, kSmoothSurface = 3;
/// Largest number of iterations, and the length of a step at which they end [m, rad].
constexpr int kIterations = 10;
constexpr double kLeastStep = 1e-4;
/// Information that keeps motions which the image does not show where they are.
constexpr double kLeastInformation = 1e-3;

int block_size(const Camera& camera) { return std::max(1, camera.width / kBlocks); }

cv::Mat1f smoothed(const cv::Mat& gray, double sigma) {
  cv::Mat1f image;
  gray.convertTo(image, CV_32F);
  cv::GaussianBlur(image, image, cv::Size(), sigma, sigma, cv::BORDER_REPLICATE);
  return image;
}

/// Returns half of the differences of the neighbors along both axes.
Eigen::RowVector2d slope(const cv::Mat1f& image, const cv::Point& at) {
  return {(image(at.y, at.x + 1) - image(at.y, at.x - 1)) / 2,
          (image(at.y + 1, at.x) - image(at.y - 1, at.x)) / 2};
}

double bilinear(const cv::Mat1f& image, const Eigen::Vector2d& uv) {
  const int col = static_cast<int>(uv.x()), row = static_cast<int>(uv.y());
  const double a = uv.x() - col, b = uv.y() - row;
  return (1 - b) * ((1 - a) * image(row, col) + a * image(row, col + 1)) +
         b * ((1 - a) * image(row + 1, col) + a * image(row + 1, col + 1));
}

/// Returns the agreement of a residual, which is also its weight in least squares (Cauchy).
double agreement(double residual) { return 1 / (1 + residual * residual); }

/// Returns the pixel with a depth in a block at which the brightness changes most.
std::optional<cv::Point> most_structured(const cv::Mat1f& image, const cv::Mat1f& depth,
                                         const cv::Rect& block) {
  std::optional<cv::Point> best;
  double largest = -1;
  for (int row = block.y; row < block.y + block.height; ++row) {
    for (int col = block.x; col < block.x + block.width; ++col) {
      if (depth(row, col) <= 0) continue;
      const double change = slope(image, {col, row}).lpNorm<1>();
      if (change <= largest) continue;
      largest = change;
      best = cv::Point(col, row);
    }
  }
  return best;
}

/// Normal equations of weighted residuals.
struct Equations {
  Matrix6d A = kLeastInformation * Matrix6d::Identity();
  Vector6d b = Vector6d::Zero();
  void add(double weight, const Eigen::Matrix<double, 1, 6>& J, double residual) {
    A += weight * J.transpose() * J;
    b += weight * J.transpose() * residual;
  }
};

}  // namespace

ImageAgreement::ImageAgreement(const Camera& camera, const RgbdFrame& first, const RgbdFrame& frame)
    : camera_(camera),
      scale_(camera.depth_sensor.tolerance<double>(kDepthSigmas, kDepthFloor)),
      brightness_(smoothed(first.gray, kSmoothing * block_size(camera))),
      depth_(first.depth),
      surfaces_(surfaces_of(frame)) {}

std::vector<ImageAgreement::Surface> ImageAgreement::surfaces_of(const RgbdFrame& frame) const {
  const int size = block_size(camera_);
  const cv::Mat1f image = smoothed(frame.gray, kSmoothing * size);
  const cv::Mat1f depth = frame.depth;
  std::vector<Surface> surfaces;
  for (int top = 1; top + size < image.rows; top += size) {
    for (int left = 1; left + size < image.cols; left += size) {
      const auto at = most_structured(image, depth, {left, top, size, size});
      if (at) surfaces.push_back({camera_.unproject(at->x, at->y, depth(*at)), image(*at)});
    }
  }
  return surfaces;
}

/// Returns the residuals of a surface; that of the brightness in gray levels.
std::optional<ImageAgreement::Comparison> ImageAgreement::compared(
    const Surface& surface, const Pose& T_first_frame) const {
  const Eigen::Vector3d p = T_first_frame * surface.p_frame;
  if (p.z() < kNearPlane) return std::nullopt;
  const Eigen::Vector2d uv = camera_.project(p);
  const cv::Point pixel(cvRound(uv.x()), cvRound(uv.y()));
  if (!cv::Rect(1, 1, depth_.cols - 2, depth_.rows - 2).contains(pixel) || depth_(pixel) <= 0)
    return std::nullopt;
  const double scale = scale_.at(depth_(pixel));
  return Comparison{p, pixel, scale, (p.z() - depth_(pixel)) / scale,
                    bilinear(brightness_, uv) - surface.brightness};
}

std::vector<ImageAgreement::Comparison> ImageAgreement::compared(const Pose& T_first_frame) const {
  std::vector<Comparison> comparisons;
  std::vector<double> differences;
  for (const Surface& surface : surfaces_) {
    const auto comparison = compared(surface, T_first_frame);
    if (!comparison) continue;
    comparisons.push_back(*comparison);
    differences.push_back(comparison->brightness);
  }
  if (comparisons.empty()) return comparisons;
  const double exposure = upper_median(differences);  // changes from frame to frame
  for (Comparison& c : comparisons) c.brightness = (c.brightness - exposure) / kBrightnessScale;
  return comparisons;
}

double ImageAgreement::of(const Pose& T_first_frame) const {
  const auto comparisons = compared(T_first_frame);
  double sum = 0;
  for (const Comparison& c : comparisons) sum += agreement(c.depth) * agreement(c.brightness);
  return comparisons.empty() ? 0 : sum / static_cast<double>(comparisons.size());
}

/// Returns whether the first frame has no edge of depth at a surface.
bool ImageAgreement::is_smooth(const Comparison& c) const {
  const auto [col, row] = std::pair(c.pixel.x, c.pixel.y);
  for (const float neighbor :
       {depth_(row, col - 1), depth_(row, col + 1), depth_(row - 1, col), depth_(row + 1, col)})
    if (std::abs(neighbor - depth_(c.pixel)) > kSmoothSurface * c.scale) return false;
  return true;
}

Pose ImageAgreement::refined(const Pose& T_first_frame) const {
  Pose best = T_first_frame;
  for (int i = 0; i < kIterations; ++i) {
    Equations equations;
    for (const Comparison& c : compared(best)) {
      const double weight = agreement(c.depth) * agreement(c.brightness);
      const double x = c.p_first.x(), y = c.p_first.y(), z = c.p_first.z();
      // Derivatives of the point by a motion (v, w) in the first frame, and of its pixel.
      Eigen::Matrix<double, 3, 6> of_point;
      of_point << Eigen::Matrix3d::Identity(), -skew(c.p_first);
      Eigen::Matrix<double, 2, 3> of_pixel;
      of_pixel << camera_.fx / z, 0, -camera_.fx * x / (z * z), 0, camera_.fy / z,
          -camera_.fy * y / (z * z);
      equations.add(weight, slope(brightness_, c.pixel) * of_pixel * of_point / kBrightnessScale,
                    c.brightness);
      if (!is_smooth(c)) continue;
      const Eigen::RowVector3d of_depth =
          Eigen::RowVector3d::UnitZ() - slope(depth_, c.pixel) * of_pixel;
      equations.add(weight, of_depth * of_point / c.scale, c.depth);
    }
    const Vector6d step = -equations.A.ldlt().solve(equations.b);
    best = Pose::exp(step) * best;
    if (step.norm() < kLeastStep) break;
  }
  return best;
}

bool ImageAgreement::shows(const Eigen::Vector3d& p_first) const {
  const auto comparison = compared(Surface{p_first, 0}, Pose());
  return comparison && std::abs(comparison->depth) < kSameSurface;
}

}  // namespace stillmap
