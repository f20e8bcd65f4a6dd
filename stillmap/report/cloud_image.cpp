// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/cloud_image.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/parallel_for.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/report/chart.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr double kElevation = 32 * std::numbers::pi / 180;  // angle of the viewer above the horizon
constexpr double kAzimuth = 24 * std::numbers::pi / 180;    // angle to the cameras' mean direction
constexpr double kFieldOfView = 42 * std::numbers::pi / 180;  // horizontal field of view
constexpr double kHeadroom = 0.9;        // height shown above the highest camera [m]
constexpr double kFilled = 0.94;         // share of the image's width or height filled by the cloud
constexpr double kOutermost = 0.002;     // share of the points on each side that may be outside
constexpr int kFramingRounds = 12;       // number of iterations, enough for convergence
constexpr double kNear = 0.05;           // smallest depth that is drawn [m]
constexpr std::size_t kSamples = 20000;  // number of points used to choose the view
constexpr double kLighting = 1.25;       // strength of the eye-dome lighting
constexpr float kDeepest = 0.06F;        // depth step beyond which the shade is constant [log m]
constexpr int kFrusta = 7;               // number of camera frusta
constexpr int kBandRows = 256;  // rows drawn at once, since lighting takes many images of memory

void check(const CloudSpan& cloud) {
  const bool fits = cloud.colors.size() == cloud.points.size() &&
                    (cloud.marked.empty() || cloud.marked.size() == cloud.points.size());
  if (fits) return;
  throw Error(fmt::format("{} points, {} colors, {} marks", cloud.points.size(),
                          cloud.colors.size(), cloud.marked.size()),
              "cloud image", "give one color per point, and one mark per point or none");
}

Eigen::Vector3d normalized_or(const Eigen::Vector3d& v, const Eigen::Vector3d& otherwise) {
  return v.norm() > 1e-6 ? Eigen::Vector3d(v.normalized()) : otherwise;
}

/// Returns the rotation of a viewer that looks along `ahead`, with the world's up upwards in the
/// image.
Eigen::Matrix3d look_along(const Eigen::Vector3d& ahead, const Eigen::Vector3d& up) {
  Eigen::Matrix3d R;
  R.col(2) = ahead;
  R.col(0) = ahead.cross(up).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

Eigen::Vector3d viewing_direction(const Trajectory& cameras, const Eigen::Vector3d& up) {
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();
  for (const auto& [stamp, T] : cameras) ahead += T.rotation().col(2);
  const Eigen::Vector3d level = normalized_or(ahead - ahead.dot(up) * up, up.unitOrthogonal());
  const Eigen::Vector3d turned = Eigen::AngleAxisd(kAzimuth, up) * level;
  return std::cos(kElevation) * turned - std::sin(kElevation) * up;
}

double cut_height(const Trajectory& cameras, const Eigen::Vector3d& up) {
  if (cameras.empty()) return std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();
  for (const auto& [stamp, T] : cameras) highest = std::max(highest, T.translation().dot(up));
  return highest + kHeadroom;
}

/// Returns a sample of the points to be drawn, in the viewer's axes.
std::vector<Eigen::Vector3d> sample(const CloudSpan& cloud, const CloudView& view,
                                    const Eigen::Matrix3d& R_world_viewer) {
  std::vector<Eigen::Vector3d> samples;
  const std::size_t step = std::max<std::size_t>(1, cloud.points.size() / kSamples);
  for (std::size_t i = 0; i < cloud.points.size(); i += step) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (p.allFinite() && p.dot(view.up) <= view.cut) {
      samples.emplace_back(R_world_viewer.transpose() * p);
    }
  }
  return samples;
}

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& samples) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : samples) values.push_back(p(axis));
    middle(axis) = (quantile(values, 0.02) + quantile(values, 0.98)) / 2;
  }
  return middle;
}

/// Returns the radius around the middle that contains nearly all samples [m].
double spread_of(const std::vector<Eigen::Vector3d>& samples, const Eigen::Vector3d& middle) {
  std::vector<double> radii;
  for (const Eigen::Vector3d& p : samples) radii.push_back((p - middle).norm());
  return quantile(radii, 1 - kOutermost);
}

/// Position and size of the samples in the image of a viewer at `eye` (in the viewer's axes). The
/// outermost samples do not count, cameras always do.
struct Framing {
  Eigen::Vector2d middle;  // middle of the samples [pixels]
  double share = 0;        // share of the image's width or height; 1: the samples just fit
};

Framing framing_of(const std::vector<Eigen::Vector3d>& samples,
                   const std::vector<Eigen::Vector3d>& cameras, const Eigen::Vector3d& eye,
                   const Camera& viewer) {
  std::array<std::vector<double>, 2> pixels;
  for (const Eigen::Vector3d& p : samples) {
    const Eigen::Vector2d pixel =
        viewer.project((p - eye).cwiseMax(Eigen::Vector3d(-1e9, -1e9, kNear)));
    for (int i : {0, 1}) pixels[i].push_back(pixel(i));
  }
  Eigen::Vector2d low, high;
  for (int i : {0, 1}) {
    low(i) = quantile(pixels[i], kOutermost);
    high(i) = quantile(pixels[i], 1 - kOutermost);
  }
  for (const Eigen::Vector3d& p : cameras) {
    const Eigen::Vector2d pixel =
        viewer.project((p - eye).cwiseMax(Eigen::Vector3d(-1e9, -1e9, kNear)));
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  const Eigen::Vector2d part =
      (high - low).cwiseQuotient(Eigen::Vector2d(viewer.width, viewer.height));
  return {(low + high) / 2, part.maxCoeff()};
}

/// Returns the eye, in the viewer's axes, from which all samples just fit. Its motion changes the
/// perspective, so the solution is iterated from far away.
Eigen::Vector3d eye_that_sees(const std::vector<Eigen::Vector3d>& samples,
                              const std::vector<Eigen::Vector3d>& cameras, const Camera& viewer) {
  const Eigen::Vector3d middle = middle_of(samples);
  Eigen::Vector3d eye = middle - Eigen::Vector3d(0, 0, 1 + 4 * spread_of(samples, middle));
  for (int round = 0; round < kFramingRounds; ++round) {
    const Framing framing = framing_of(samples, cameras, eye, viewer);
    const double distance = middle.z() - eye.z();
    eye.x() += (framing.middle.x() - viewer.cx) / viewer.fx * distance;
    eye.y() += (framing.middle.y() - viewer.cy) / viewer.fy * distance;
    eye.z() = middle.z() - std::max(0.1, distance * framing.share / kFilled);
  }
  return eye;
}

Camera viewer_camera(const CloudImageOptions& options) {
  Camera viewer;
  viewer.name = "viewer";
  viewer.width = options.width;
  viewer.height = options.height;
  viewer.fx = viewer.fy = options.width / 2.0 / std::tan(kFieldOfView / 2);
  viewer.cx = (options.width - 1) / 2.0;
  viewer.cy = (options.height - 1) / 2.0;
  return viewer;
}

/// A band of rows of the supersampled image.
struct Band {
  int first;        // its first row in the whole image
  cv::Mat3b color;  // as wide as the whole image
  cv::Mat1f depth;  // depth along the optical axis [m]; infinite for the background
};

cv::Vec3b color_of(const CloudSpan& cloud, std::size_t i) {
  const auto& [red, green, blue] = cloud.colors[i];
  if (cloud.marked.empty() || cloud.marked[i] == 0) return {blue, green, red};
  const double gray = (red + 2 * green + blue) / 4.0;  // keeps some of the texture visible
  return {cv::saturate_cast<std::uint8_t>(15 + 0.2 * gray),
          cv::saturate_cast<std::uint8_t>(5 + 0.2 * gray),
          cv::saturate_cast<std::uint8_t>(115 + 0.55 * gray)};
}

void splat(Band& band, const Eigen::Vector2d& center, double radius, float z,
           const cv::Vec3b& color) {
  const int x0 = std::max(0, static_cast<int>(std::ceil(center.x() - radius)));
  const int y0 = std::max(0, static_cast<int>(std::ceil(center.y() - radius)) - band.first);
  const int x1 = std::min(band.color.cols - 1, static_cast<int>(std::floor(center.x() + radius)));
  const int y1 =
      std::min(band.color.rows - 1, static_cast<int>(std::floor(center.y() + radius)) - band.first);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      if (z >= band.depth(y, x)) continue;
      band.depth(y, x) = z;
      band.color(y, x) = color;
    }
  }
}

void draw_points(Band& band, const CloudSpan& cloud, const CloudView& view,
                 const CloudImageOptions& options) {
  const Pose T_viewer_world = view.T_world_viewer.inverse();
  const Eigen::Matrix3d R = T_viewer_world.rotation();
  const double s = options.supersampling;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p_world = cloud.points[i].cast<double>();
    if (!p_world.allFinite() || p_world.dot(view.up) > view.cut) continue;
    const Eigen::Vector3d p = R * p_world + T_viewer_world.translation();
    if (p.z() < kNear) continue;
    const Eigen::Vector2d center = s * view.viewer.project(p);
    const double radius = std::max(0.5, s * view.viewer.fx * options.splat / p.z() / 2);
    if (center.x() + radius < 0 || center.y() + radius < band.first ||
        center.x() - radius >= band.color.cols ||
        center.y() - radius >= band.first + band.color.rows) {
      continue;
    }
    splat(band, center, radius, static_cast<float>(p.z()), color_of(cloud, i));
  }
}

/// Returns the radius of the neighborhood that lighting uses [pixels].
int lighting_reach(int supersampling) { return 3 * supersampling; }

/// Applies eye-dome lighting: darkens a pixel by the logarithm of its depth relative to that of its
/// neighbors on two rings.
void light(Band& band, int supersampling) {
  const int margin = lighting_reach(supersampling);
  cv::Mat1f log_depth, padded;
  cv::log(band.depth, log_depth);
  cv::copyMakeBorder(log_depth, padded, margin, margin, margin, margin, cv::BORDER_REPLICATE);
  cv::Mat1f behind = cv::Mat1f::zeros(band.depth.size());
  for (int y = 0; y < behind.rows; ++y) {
    float* sum = behind[y];
    for (const int radius : {supersampling, margin}) {
      for (const int dy : {-radius, 0, radius}) {
        for (const int dx : {-radius, 0, radius}) {
          const float *here = log_depth[y], *there = padded[y + margin + dy] + margin + dx;
          for (int x = 0; x < behind.cols; ++x)  // 0 beside the background (inf - inf)
            sum[x] += std::min(std::max(0.0F, here[x] - there[x]), kDeepest);
        }
      }
    }
  }
  cv::Mat1f shade;
  cv::exp(-kLighting * behind, shade);
  for (int y = 0; y < shade.rows; ++y) {
    for (int x = 0; x < shade.cols; ++x) band.color(y, x) *= shade(y, x);
  }
}

/// Draws a vertical gradient as background.
void draw_background(Band& band, int rows_of_all, bool dark) {
  const cv::Vec3d top = dark ? cv::Vec3d(34, 27, 22) : cv::Vec3d(252, 251, 250);
  const cv::Vec3d bottom = dark ? cv::Vec3d(58, 48, 42) : cv::Vec3d(232, 228, 224);
  for (int y = 0; y < band.color.rows; ++y) {
    const double s = static_cast<double>(band.first + y) / rows_of_all;
    const cv::Vec3b color = top * (1 - s) + bottom * s;
    for (int x = 0; x < band.color.cols; ++x) {
      if (std::isinf(band.depth(y, x))) band.color(y, x) = color;
    }
  }
}

/// Returns the rows first .. last - 1 of an image of `size`.
cv::Mat3b draw_rows(int first, int last, const cv::Size& size, const CloudSpan& cloud,
                    const CloudView& view, const CloudImageOptions& options) {
  const int reach = lighting_reach(options.supersampling);
  const int top = std::max(0, first - reach), bottom = std::min(size.height, last + reach);
  Band band{top, cv::Mat3b(bottom - top, size.width, cv::Vec3b()),
            cv::Mat1f(bottom - top, size.width, std::numeric_limits<float>::infinity())};
  draw_points(band, cloud, view, options);
  light(band, options.supersampling);
  draw_background(band, size.height, options.dark);
  return band.color.rowRange(first - top, last - top);
}

/// Draws lines of the world over the image.
class Overlay {
 public:
  Overlay(cv::Mat3b& image, const CloudView& view, int supersampling)
      : image_(image),
        T_viewer_world_(view.T_world_viewer.inverse()),
        viewer_(view.viewer),
        scale_(supersampling) {}

  void line(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const cv::Scalar& color,
            double thickness) {
    const Eigen::Vector3d from = T_viewer_world_ * a, to = T_viewer_world_ * b;
    if (from.z() < kNear || to.z() < kNear) return;
    cv::line(image_, pixel(from), pixel(to), color, std::max(1, cvRound(thickness * scale_)),
             cv::LINE_AA, kShift);
  }

  /// Draws the viewing pyramid of a camera, `depth` meters long; 4:3, 57 degrees wide like that of
  /// a Kinect.
  void frustum(const Pose& T_world_camera, double depth, const cv::Scalar& color) {
    const double w = 0.54 * depth, h = 0.41 * depth;
    const std::array<Eigen::Vector3d, 4> corners{T_world_camera * Eigen::Vector3d(-w, -h, depth),
                                                 T_world_camera * Eigen::Vector3d(w, -h, depth),
                                                 T_world_camera * Eigen::Vector3d(w, h, depth),
                                                 T_world_camera * Eigen::Vector3d(-w, h, depth)};
    for (std::size_t i = 0; i < 4; ++i) {
      line(T_world_camera.translation(), corners[i], color, 1.2);
      line(corners[i], corners[(i + 1) % 4], color, 1.2);
    }
  }

 private:
  static constexpr int kShift = 4;
  cv::Point pixel(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d uv = scale_ * (1 << kShift) * viewer_.project(p);
    return {cvRound(std::clamp(uv.x(), -1e6, 1e6)), cvRound(std::clamp(uv.y(), -1e6, 1e6))};
  }

  cv::Mat3b& image_;
  Pose T_viewer_world_;
  Camera viewer_;
  double scale_;
};

void draw_cameras(cv::Mat3b& image, const Trajectory& cameras, const CloudView& view,
                  const CloudImageOptions& options) {
  const cv::Scalar path(60, 190, 255), frame(130, 215, 255);
  Overlay overlay(image, view, options.supersampling);
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    overlay.line(cameras[i - 1].T_world_camera.translation(),
                 cameras[i].T_world_camera.translation(), path, 2);
  }
  const auto frusta = std::min<std::size_t>(kFrusta, cameras.size());
  for (std::size_t i = 0; i < frusta; ++i) {
    const std::size_t place = frusta == 1 ? 0 : i * (cameras.size() - 1) / (frusta - 1);
    overlay.frustum(cameras[place].T_world_camera, 0.12, frame);
  }
}

}  // namespace

CloudView choose_cloud_view(const CloudSpan& cloud, const Trajectory& cameras,
                            const CloudImageOptions& options) {
  CloudView view;
  view.viewer = viewer_camera(options);
  view.up = mean_up(cameras);
  view.cut = cut_height(cameras, view.up);
  const Eigen::Matrix3d R = look_along(viewing_direction(cameras, view.up), view.up);
  const std::vector<Eigen::Vector3d> samples = sample(cloud, view, R);
  if (samples.empty()) {
    view.T_world_viewer = Pose(R, Eigen::Vector3d::Zero());
    return view;
  }
  std::vector<Eigen::Vector3d> positions;
  for (const auto& [stamp, T] : cameras) {
    positions.emplace_back(R.transpose() * T.translation());
  }
  view.T_world_viewer = Pose(R, R * eye_that_sees(samples, positions, view.viewer));
  return view;
}

cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras, const CloudView& view,
                   const CloudImageOptions& options) {
  check(cloud);
  const cv::Size size(options.width * options.supersampling,
                      options.height * options.supersampling);
  cv::Mat3b image(size);
  const auto draw_band = [&](std::size_t band) {
    const int first = static_cast<int>(band) * kBandRows;
    const int last = std::min(first + kBandRows, size.height);
    draw_rows(first, last, size, cloud, view, options).copyTo(image.rowRange(first, last));
  };
  const auto bands = static_cast<std::size_t>((size.height + kBandRows - 1) / kBandRows);
  parallel_for(bands, all_threads(), [&] { return draw_band; });
  if (options.draw_cameras) draw_cameras(image, cameras, view, options);
  cv::Mat finished;
  cv::resize(image, finished, {options.width, options.height}, 0, 0, cv::INTER_AREA);
  return finished;
}

cv::Mat draw_cloud(const CloudSpan& cloud, const Trajectory& cameras,
                   const CloudImageOptions& options) {
  check(cloud);
  return draw_cloud(cloud, cameras, choose_cloud_view(cloud, cameras, options), options);
}

}  // namespace stillmap
