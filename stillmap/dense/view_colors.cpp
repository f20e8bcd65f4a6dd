// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_colors.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/dense/voxel_index.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include <Eigen/SparseCholesky>

namespace stillmap {
namespace {

/// Side of the cubes of points that a view skips together [m].
constexpr double kGroupSide = 0.5;
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

struct Group {
  Eigen::Vector3f center;
  std::vector<std::uint32_t> points;
};

std::vector<Group> grouped(const std::vector<Eigen::Vector3f>& points) {
  VoxelIndex index;
  std::vector<Group> groups;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto voxel = voxel_at(points[i].cast<double>(), kGroupSide);
    if (!voxel) continue;
    const std::uint32_t group = index.add(*voxel);
    if (group == groups.size())
      groups.push_back({center_of(*voxel, kGroupSide).cast<float>(), {}});
    groups[group].points.push_back(i);
  }
  return groups;
}

struct ColorSample {
  Eigen::Vector3f rgb;
  float weight;
  bool is_shown;  // whether the pixels show the point, not something else on its ray
};

class ColorView {
 public:
  explicit ColorView(const PosedView& posed)
      : view_(*posed.view),
        agreement_(view_.camera.depth_sensor.tolerance<float>(kSigmas, kFloor)),
        R_(posed.T_world_camera.rotation().transpose().cast<float>()),
        t_(posed.T_world_camera.inverse().translation().cast<float>()),
        fx_(static_cast<float>(view_.camera.fx)),
        fy_(static_cast<float>(view_.camera.fy)),
        cx_(static_cast<float>(view_.camera.cx)),
        cy_(static_cast<float>(view_.camera.cy)) {}

  /// Returns whether points of a group may be in the image.
  bool reaches(const Group& group) const {
    constexpr auto kRadius = static_cast<float>(0.87 * kGroupSide);  // half a diagonal
    const Eigen::Vector3f p = R_ * group.center + t_;
    if (p.z() < -kRadius) return false;
    // Distances from the four planes through the camera center and the borders of the image.
    const auto is_beyond = [&](float focal, float x, float border) {
      return (focal * x - border * p.z()) / std::hypot(focal, border) > kRadius;
    };
    const auto right = static_cast<float>(view_.depth.cols) - cx_;
    const auto bottom = static_cast<float>(view_.depth.rows) - cy_;
    return !is_beyond(fx_, p.x(), right) && !is_beyond(fx_, -p.x(), cx_) &&
           !is_beyond(fy_, p.y(), bottom) && !is_beyond(fy_, -p.y(), cy_);
  }

  std::optional<ColorSample> at(const Eigen::Vector3f& p_world) const {
    const Eigen::Vector3f p = R_ * p_world + t_;
    if (p.z() < 0.1F) return std::nullopt;
    const float u = fx_ * p.x() / p.z() + cx_, v = fy_ * p.y() / p.z() + cy_;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(view_.depth.cols - 1) &&
          v < static_cast<float>(view_.depth.rows - 1)))
      return std::nullopt;
    const int col = static_cast<int>(u), row = static_cast<int>(v);
    const float right = u - static_cast<float>(col), down = v - static_cast<float>(row);
    const float tolerance = agreement_.at(p.z());
    Eigen::Vector3f sum = Eigen::Vector3f::Zero(), all = Eigen::Vector3f::Zero();
    float shown = 0;
    for (int i = 0; i < 4; ++i) {
      const int r = row + i / 2, c = col + i % 2;
      const float share = (i % 2 != 0 ? right : 1 - right) * (i / 2 != 0 ? down : 1 - down);
      const cv::Vec3b& bgr = view_.color(r, c);
      const Eigen::Vector3f rgb(bgr[2], bgr[1], bgr[0]);
      all += share * rgb;
      const std::uint8_t kind = view_.kind(r, c);
      const float z = view_.depth(r, c) * DenseView::kDepthUnit;
      if (kind == kNoSurface || kind == kMoverSurface || std::abs(z - p.z()) > tolerance) continue;
      sum += share * rgb;
      shown += share;
    }
    const float near = 1 / (p.z() * p.z() * p.z() * p.z());
    if (shown < kShown) return ColorSample{all, kHidden * near, false};
    return ColorSample{sum / shown, shown * near, true};
  }

 private:
  const DenseView& view_;
  DepthPolynomial<float> agreement_;
  Eigen::Matrix3f R_;  // R_camera_world
  Eigen::Vector3f t_;
  float fx_, fy_, cx_, cy_;
};

/// Calls `use(view, point, sample)` for all points in each view, by view.
template <typename Use>
void for_each_sample(const std::vector<Eigen::Vector3f>& points,
                     const std::vector<PosedView>& views, const Use& use) {
  const std::vector<Group> groups = grouped(points);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ColorView view(views[i]);
    for (const Group& group : groups) {
      if (!view.reaches(group)) continue;
      for (const std::uint32_t point : group.points) {
        if (const auto sample = view.at(points[point])) use(i, point, *sample);
      }
    }
    views[i].view->drop_pages();
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
  for_each_sample(points, views, [&](std::size_t view, std::uint32_t point, const auto& sample) {
    if (!sample.is_shown || sample.rgb.minCoeff() < kDarkest || sample.rgb.maxCoeff() > kBrightest)
      return;
    logs.push_back({static_cast<int>(view), static_cast<int>(point),
                    sample.rgb.template cast<double>().array().log().matrix()});
  });
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
                                const std::vector<Eigen::Vector3f>& gains) {
  const TraceScope scope("surface colors");
  std::vector<Eigen::Vector4f> sums(points.size(), Eigen::Vector4f::Zero());
  for_each_sample(points, views, [&](std::size_t view, std::uint32_t point, const auto& sample) {
    const Eigen::Vector3f rgb = sample.rgb.cwiseProduct(gains[view]).cwiseMin(255.0F);
    sums[point] += sample.weight * rgb.homogeneous();
  });
  std::vector<Rgb> colors;
  colors.reserve(points.size());
  for (const Eigen::Vector4f& sum : sums) {
    const Eigen::Vector3f rgb = sum.head<3>() / std::max(sum[3], 1e-20F);
    const auto channel = [&](int c) { return static_cast<std::uint8_t>(std::lround(rgb[c])); };
    colors.push_back({channel(0), channel(1), channel(2)});
  }
  return colors;
}

}  // namespace stillmap
