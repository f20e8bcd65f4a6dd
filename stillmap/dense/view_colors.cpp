// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_colors.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/dense/projected_points.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <Eigen/SparseCholesky>

namespace stillmap {
namespace {

/// Standard deviations of a depth, and floor [m], within which a pixel shows a point.
constexpr double kSigmas = 2, kFloor = 0.01;
/// Weight, relative to that of a pixel which shows the point, of one that does not: it only counts
/// if no other pixel shows the point.
constexpr float kHidden = 1e-6F;
/// Share of the weights of the four pixels around a point that must show it.
constexpr float kShown = 0.5F;

/// Number of points that determine the gains, the range of their intensities [0..255], and the
/// residual of a logarithm above which its weight falls.
constexpr std::size_t kGainPoints = 20000;
constexpr float kDarkest = 16, kBrightest = 240;
constexpr double kLogOutlier = 0.1;
/// Weight of the prior that a gain is 1, in observations.
constexpr double kPrior = 1;

struct ColorSample {
  Eigen::Vector3f rgb;
  float weight;
  bool is_shown;  // whether the pixels show the point, not something else on its ray
};

/// The image of the photo of a view, and the pixels that other frames gave the view; both empty
/// without one.
struct Photo {
  cv::Mat3b image;
  cv::Mat1b others;
};

Photo photo_with_others(const DenseView& view) {
  Photo photo{image_of(view.photo), {}};
  if (!photo.image.empty()) photo.others = pixels_of_others(view, photo.image);
  return photo;
}

/// Returns whether the photo shows what the view shows at a point.
bool shows(const Photo& photo, const ProjectedPoint& point) {
  if (photo.image.empty()) return false;
  for (int i = 0; i < 4; ++i)
    if (photo.others(point.row + i / 2, point.col + i % 2) != 0) return false;
  return true;
}

/// Returns the color of a photo at a point of its view, interpolated between pixels.
Eigen::Vector3f photo_color(const cv::Mat3b& photo, int stride, const ProjectedPoint& point) {
  const auto at = [&](int pixel, float part, int size) {
    const float place = static_cast<float>(stride) * (static_cast<float>(pixel) + part);
    return std::min(place, static_cast<float>(size) - 1.001F);
  };
  const float u = at(point.col, point.right, photo.cols), v = at(point.row, point.down, photo.rows);
  const int col = static_cast<int>(u), row = static_cast<int>(v);
  const ProjectedPoint in_photo{row, col, u - static_cast<float>(col), v - static_cast<float>(row),
                                point.z};
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i = 0; i < 4; ++i) sum += in_photo.share(i) * rgb_of(photo(row + i / 2, col + i % 2));
  return sum;
}

/// @param photo  of the view; empty: the colors are those of its pixels
ColorSample color_at(const DenseView& view, const Photo& photo, const ProjectedPoint& point,
                     float tolerance) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero(), all = Eigen::Vector3f::Zero();
  float shown = 0;
  for (int i = 0; i < 4; ++i) {
    const int row = point.row + i / 2, col = point.col + i % 2;
    const float share = point.share(i);
    const Eigen::Vector3f rgb = rgb_of(view.color(row, col));
    all += share * rgb;
    const std::uint8_t kind = view.kind(row, col);
    const float z = view.depth(row, col) * DenseView::kDepthUnit;
    if (kind == kNoSurface || kind == kMoverSurface || std::abs(z - point.z) > tolerance) continue;
    sum += share * rgb;
    shown += share;
  }
  const float near = 1 / (point.z * point.z * point.z * point.z);
  if (shown < kShown) return {all, kHidden * near, false};
  if (shows(photo, point))
    return {photo_color(photo.image, view.stride, point), shown * near, true};
  return {sum / shown, shown * near, true};
}

/// Calls `use(view, i, sample)` for all points in each view, by view. With several threads the
/// order of the points is open.
template <typename Use>
void for_each_sample(const PointGroups& points, const std::vector<PosedView>& views,
                     ColorSource source, int threads, const Use& use) {
  constexpr float kMargin = 1;  // the surface of a pixel reaches beyond its center [pixels]
  for (std::size_t number = 0; number < views.size(); ++number) {
    const DenseView& view = *views[number].view;
    const Photo photo = source == ColorSource::kPhoto ? photo_with_others(view) : Photo();
    const auto agreement = view.camera.depth_sensor.tolerance<float>(kSigmas, kFloor);
    const auto use_color = [&](std::size_t i, const ProjectedPoint& at) {
      use(number, i, color_at(view, photo, at, agreement.at(at.z)));
    };
    points.for_each_in(ViewProjection(views[number], kMargin), threads, use_color);
    view.drop_pages();
  }
}

/// The logarithm of a color that a view gives a point.
struct LogColor {
  int view, point;
  Eigen::Vector3d log;
};

std::vector<LogColor> log_colors(const std::vector<Eigen::Vector3f>& points,
                                 const std::vector<PosedView>& views) {
  std::vector<LogColor> logs;
  const PointGroups groups(points);
  const auto add = [&](std::size_t view, std::size_t point, const ColorSample& sample) {
    if (!sample.is_shown || sample.rgb.minCoeff() < kDarkest || sample.rgb.maxCoeff() > kBrightest)
      return;
    logs.push_back({static_cast<int>(view), static_cast<int>(point),
                    sample.rgb.cast<double>().array().log().matrix()});
  };
  for_each_sample(groups, views, ColorSource::kView, 1, add);
  return logs;
}

/// Rows: the logarithms of the gains of the views, then of the colors of the points.
using LogSolution = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Returns the minimum of the sum of w |log + gain - color|^2 with the prior.
LogSolution solved(const std::vector<LogColor>& logs, const std::vector<double>& weights, int views,
                   int points) {
  std::vector<Eigen::Triplet<double>> entries;
  LogSolution right = LogSolution::Zero(views + points, 3);
  for (int i = 0; i < views + points; ++i) entries.emplace_back(i, i, i < views ? kPrior : 1e-9);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const int a = logs[i].view, b = views + logs[i].point;
    const double w = weights[i];
    entries.emplace_back(a, a, w);
    entries.emplace_back(b, b, w);
    entries.emplace_back(b, a, -w);
    right.row(a) -= w * logs[i].log.transpose();
    right.row(b) += w * logs[i].log.transpose();
  }
  Eigen::SparseMatrix<double> matrix(views + points, views + points);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
}

}  // namespace

std::vector<Eigen::Vector3f> color_gains(const std::vector<Eigen::Vector3f>& points,
                                         const std::vector<PosedView>& views) {
  const TraceScope scope("color gains");
  std::vector<Eigen::Vector3f> some;
  const std::size_t step = points.size() / kGainPoints + 1;
  for (std::size_t i = 0; i < points.size(); i += step) some.push_back(points[i]);
  const std::vector<LogColor> logs = log_colors(some, views);
  const int view_count = static_cast<int>(views.size());
  std::vector<double> weights(logs.size(), 1);
  LogSolution solution;
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    solution = solved(logs, weights, view_count, static_cast<int>(some.size()));
    for (std::size_t i = 0; i < logs.size(); ++i) {
      const auto& [view, point, log] = logs[i];
      const double residual =
          (log.transpose() + solution.row(view) - solution.row(view_count + point)).norm();
      weights[i] = 1 / (1 + std::pow(residual / kLogOutlier, 2));
    }
  }
  std::vector<Eigen::Vector3f> gains;
  for (int view = 0; view < view_count; ++view)
    gains.emplace_back(solution.row(view).transpose().array().exp().matrix().cast<float>());
  return gains;
}

std::vector<Rgb> surface_colors(const std::vector<Eigen::Vector3f>& points,
                                const std::vector<PosedView>& views,
                                const std::vector<Eigen::Vector3f>& gains, ColorSource source) {
  const TraceScope scope("surface colors");
  const PointGroups groups(points);
  std::vector<Eigen::Vector4f> sums(groups.size(), Eigen::Vector4f::Zero());
  const auto add = [&](std::size_t view, std::size_t i, const ColorSample& sample) {
    const Eigen::Vector3f rgb = sample.rgb.cwiseProduct(gains[view]).cwiseMin(255.0F);
    sums[i] += sample.weight * rgb.homogeneous();
  };
  for_each_sample(groups, views, source, all_threads(), add);
  std::vector<Rgb> colors(points.size(), Rgb{0, 0, 0});
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const Eigen::Vector3f rgb = sums[i].head<3>() / std::max(sums[i][3], 1e-20F);
    const auto channel = [&](int c) { return static_cast<std::uint8_t>(std::lround(rgb[c])); };
    colors[groups.place(i)] = {channel(0), channel(1), channel(2)};
  }
  return colors;
}

}  // namespace stillmap
