// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/surface_error.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/geometry/voxel_key.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Distance to the true surface beyond which a point is stray [m].
constexpr double kReach = 0.1;
/// Radius of the patch for the normal of a true point [m].
constexpr double kPatch = 0.025;
/// Number of frames that must observe a true point to make it visible.
constexpr std::uint16_t kMinFrames = 3;
/// Width of the excluded band around masks [pixels].
constexpr int kMaskMargin = 6;
/// Every kStride-th true point is evaluated for completeness.
constexpr std::size_t kStride = 2;
/// Side of the cells of the point index [m].
constexpr double kIndexCell = 0.025;
/// Largest distance of a completeness query [m].
constexpr double kFar = 0.05;
/// Number of bins of the histogram of sensor errors.
constexpr std::size_t kBins = 1000;

/// Largest standard deviation of a depth that counts [m]: half a voxel of the ghost figure, and
/// that of a Kinect v1 at 4 m.
constexpr double kMaxSigma = 0.025824;
/// A measured depth agrees with the true surface within this number of standard deviations plus
/// this floor [m].
constexpr double kAgreementSigmas = 3, kAgreementFloor = 0.02;

/// Returns the quantile of a histogram, in bins.
double quantile_of(const std::vector<std::uint32_t>& histogram, double share) {
  double all = 0, sum = 0;
  for (const std::uint32_t n : histogram) all += n;
  for (std::size_t bin = 0; bin < histogram.size(); ++bin) {
    sum += histogram[bin];
    if (sum > 0 && sum >= share * all) return static_cast<double>(bin) + 0.5;
  }
  return 0;
}

double share_of(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::vector<Eigen::Vector3f> in_truth(std::span<const Eigen::Vector3f> points, const Pose& T) {
  std::vector<Eigen::Vector3f> moved;
  moved.reserve(points.size());
  for (const Eigen::Vector3f& p : points) moved.push_back((T * p.cast<double>()).cast<float>());
  return moved;
}

}  // namespace

NearestPoint::NearestPoint(std::vector<Eigen::Vector3f> points, double reach)
    : points_(std::move(points)), reach_(reach), cell_(std::min(reach, kIndexCell)) {
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (!points_[i].allFinite()) continue;
    cells_[voxel_of(clamped_lattice_at(points_[i].cast<double>(), cell_))].push_back(i);
  }
}

std::vector<std::uint32_t> NearestPoint::around(const Eigen::Vector3f& p, float radius) const {
  std::vector<std::uint32_t> found;
  const auto edge = Eigen::Vector3f::Constant(radius);
  const Lattice low = clamped_lattice_at((p - edge).cast<double>(), cell_);
  const Lattice high = clamped_lattice_at((p + edge).cast<double>(), cell_);
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int z = low.z(); z <= high.z(); ++z) {
        const auto cell = cells_.find(voxel_of({x, y, z}));
        if (cell == cells_.end()) continue;
        for (const std::uint32_t i : cell->second) {
          if ((points_[i] - p).squaredNorm() <= radius * radius) found.push_back(i);
        }
      }
    }
  }
  return found;
}

std::optional<NearestPoint::Found> NearestPoint::find(const Eigen::Vector3f& p) const {
  if (!p.allFinite()) return std::nullopt;
  // Most points lie near the surface, so a small radius is searched first.
  for (double radius = std::min(reach_, 0.4 * kIndexCell);;
       radius = std::min(reach_, 2.5 * radius)) {
    std::optional<Found> best;
    for (const std::uint32_t i : around(p, static_cast<float>(radius))) {
      const float distance = (points_[i] - p).norm();
      const bool nearer =
          !best || distance < best->distance || (distance == best->distance && i < best->index);
      if (nearer) best = {i, distance};
    }
    if (best || radius >= reach_) return best;
  }
}

TrueSurface::TrueSurface(std::vector<Eigen::Vector3f> points)
    : index_(std::move(points), kReach),
      frames_(index_.points().size(), 0),
      sensor_errors_(kBins, 0) {
  if (index_.points().empty()) {
    throw Error("the true surface has no points", "--surface",
                "name a cloud of the static scene, one point per centimeter or more");
  }
  normals_.reserve(frames_.size());
  for (std::uint32_t i = 0; i < frames_.size(); ++i) normals_.push_back(normal(i));
}

/// Returns the normal of the plane through the neighboring points; zero if there are fewer than
/// five.
Eigen::Vector3f TrueSurface::normal(std::uint32_t index) const {
  const Eigen::Vector3f& center = index_.points()[index];
  const auto patch = index_.around(center, static_cast<float>(kPatch));
  if (patch.size() < 5) return Eigen::Vector3f::Zero();
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const std::uint32_t i : patch) mean += index_.points()[i] - center;
  mean /= static_cast<float>(patch.size());
  Eigen::Matrix3f moments = Eigen::Matrix3f::Zero();
  for (const std::uint32_t i : patch) {
    const Eigen::Vector3f d = index_.points()[i] - center - mean;
    moments += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver(moments);
  return solver.eigenvectors().col(0);
}

void TrueSurface::look(const MaskedFrame& frame, const Pose& T_world_camera, const Camera& camera) {
  const int side = 2 * kMaskMargin + 1;
  cv::Mat1b masked;
  cv::dilate(frame.mask, masked, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  const Pose T_camera_world = T_world_camera.inverse();
  const Eigen::Matrix3f R = T_camera_world.rotation().cast<float>();
  const Eigen::Vector3f t = T_camera_world.translation().cast<float>();
  const float max_depth = camera.depth_sensor.depth_at_sigma(kMaxSigma);
  const auto agreement = camera.depth_sensor.tolerance<double>(kAgreementSigmas, kAgreementFloor);
  for (std::size_t i = 0; i < frames_.size(); i += kStride) {
    const Eigen::Vector3f p = R * index_.points()[i] + t;
    if (p.z() < 0.1F || p.z() > max_depth) continue;
    const Eigen::Vector2d pixel = camera.project(p.cast<double>());
    if (!camera.contains(pixel.x(), pixel.y())) continue;
    const int u = cvRound(pixel.x()), v = cvRound(pixel.y());
    const double z = frame.depth.at<float>(v, u);
    if (!(z > 0) || masked(v, u) != 0) continue;
    const double error = std::abs(z - p.z());
    if (error > agreement.at(p.z())) continue;
    if (frames_[i] < std::numeric_limits<std::uint16_t>::max()) ++frames_[i];
    const double bin = error / kReach * kBins;
    ++sensor_errors_[std::min(kBins - 1, static_cast<std::size_t>(bin))];
  }
}

double TrueSurface::distance(const Eigen::Vector3f& p) const {
  const auto nearest = index_.find(p);
  if (!nearest) return kReach;
  const Eigen::Vector3f d = p - index_.points()[nearest->index];
  const float along = std::abs(normals_[nearest->index].dot(d));
  const float aside = std::sqrt(std::max(0.0F, d.squaredNorm() - along * along));
  return aside < 0.6 * kPatch ? along : nearest->distance;
}

SurfaceFigures TrueSurface::judge(std::span<const Eigen::Vector3f> points,
                                  const Pose& T_truth_estimate) const {
  const NearestPoint cloud(in_truth(points, T_truth_estimate), kFar);
  SurfaceFigures figures{.points = points.size()};
  std::vector<double> distances;
  std::size_t stray = 0, complete_2cm = 0, complete_5cm = 0;
  for (const Eigen::Vector3f& p : cloud.points()) {
    distances.push_back(distance(p));
    stray += distances.back() >= kReach;
  }
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (frames_[i] < kMinFrames) continue;
    ++figures.visible;
    const auto nearest = cloud.find(index_.points()[i]);
    complete_2cm += nearest && nearest->distance <= 0.02F;
    complete_5cm += nearest.has_value();
  }
  if (!distances.empty()) {
    figures.median = quantile(distances, 0.5);
    figures.p95 = quantile(distances, 0.95);
  }
  figures.stray_share = share_of(stray, figures.points);
  figures.complete_2cm = share_of(complete_2cm, figures.visible);
  figures.complete_5cm = share_of(complete_5cm, figures.visible);
  const double bin = kReach / static_cast<double>(kBins);
  figures.sensor_median = quantile_of(sensor_errors_, 0.5) * bin;
  figures.sensor_p95 = quantile_of(sensor_errors_, 0.95) * bin;
  return figures;
}

std::string surface_text(const SurfaceFigures& f) {
  return fmt::format(
      "distance to the true surface: median {:.4f} m, 95 % within {:.4f} m, {:.3f} % stray\n"
      "a single measurement of it:   median {:.4f} m, 95 % within {:.4f} m\n"
      "completeness: {:.2f} % within 2 cm, {:.2f} % within 5 cm, of {} visible points\n",
      f.median, f.p95, 100 * f.stray_share, f.sensor_median, f.sensor_p95, 100 * f.complete_2cm,
      100 * f.complete_5cm, f.visible);
}

void to_json(nlohmann::json& json, const SurfaceFigures& f) {
  json = {{"points", f.points},
          {"distance_median_m", f.median},
          {"distance_p95_m", f.p95},
          {"stray_share", f.stray_share},
          {"visible_places", f.visible},
          {"complete_2cm", f.complete_2cm},
          {"complete_5cm", f.complete_5cm},
          {"sensor_median_m", f.sensor_median},
          {"sensor_p95_m", f.sensor_p95}};
}

}  // namespace stillmap
