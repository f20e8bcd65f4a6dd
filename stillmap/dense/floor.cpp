// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/floor.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/geometry/mean_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <span>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// Area of a surfel [m^2].
constexpr double kSurfelArea = kFloorSurfel * kFloorSurfel;

/// Largest angle between the mean upward direction of the images and that of the world.
constexpr double kLargestPitch = 50 * kDegree;
/// Standard deviation of the direction of gravity, and its largest difference from that of
/// surfaces.
constexpr double kGravitySigma = 0.5 * kDegree, kGravityGate = 2 * kDegree;
/// Largest mean angle by which the cameras look up; beyond it hardly any floor is in view.
constexpr double kLargestUpwardView = 20 * kDegree;
/// Angle between neighboring directions of the search.
constexpr double kSearchStep = 4 * kDegree;
/// Standard deviation of the roll of hand-held and mounted cameras.
constexpr double kRollSigma = 15 * kDegree;
/// Angle from horizontal or vertical at which a surface stops to support a direction in the search,
/// and in the rounds of its refinement.
constexpr double kSearchGate = 10 * kDegree;
constexpr double kGates[] = {10 * kDegree, 5 * kDegree, 3 * kDegree, 3 * kDegree};
/// Weights of horizontal and of vertical surfaces in the search: the negative logarithm of the
/// chance that a surface of random direction is within kSearchGate of them.
const double kHorizontalWeight = -std::log(1 - std::cos(kSearchGate));
const double kVerticalWeight = -std::log(std::sin(kSearchGate));
/// Maximum number of surfels in the search.
constexpr std::size_t kSearchSurfels = 4000;
/// Area whose normals are one piece of evidence in the search, since they err alike [m^2].
constexpr double kVote = 0.5;
/// Angle within which directions of the search are the same one, and the odds against all others
/// from which it is certain (0.95).
constexpr double kSameDirection = 20 * kDegree, kCertainOdds = 19;
/// Odds that images are upright rather than turned by 90 degrees, before the surfaces are seen.
constexpr double kUprightOdds = 20;

/// Height of a level above and below its middle: noise of the depth and of the poses [m].
constexpr double kLevel = 0.03;
/// Surfaces lower than this under a level are below it [m].
constexpr double kBelow = 0.10;
/// Largest tilt of a surfel of a level.
constexpr double kLevelTilt = 15 * kDegree;
/// Smallest area of a level that counts [m^2].
constexpr double kMinLevelArea = 0.15;

/// Side of the cubes in which the normals of a surface err alike: by depth and poses [m].
constexpr double kPatch = 1;
/// Standard deviation of their common error before any are seen, added to the measured one.
constexpr double kPatchSigma = 2 * kDegree;
/// Largest standard deviation of the upward direction: it is within 2 degrees by two of them.
constexpr double kLargestSigma = 1 * kDegree;
/// Minimum confidence of a floor.
constexpr double kCertain = 0.5;
/// Area of a floor of which half is believed [m^2].
constexpr double kHalfCertainArea = 0.3;
/// Tables are narrower than this [m]. Where the camera is lower than kHigh [m] above a level, that
/// must be wider to be the floor; otherwise kMinWidth [m] is enough.
constexpr double kWiderThanATable = 1.2, kHigh = 1.1, kMinWidth = 0.6;
/// Decay of the confidence with the area below a level, relative to the area of the level.
constexpr double kBelowWeight = 3;

using Directions = std::vector<Eigen::Vector3d>;

/// Returns the angle between a surface and the nearest of horizontal and vertical.
double angle_from_horizontal_or_vertical(const Eigen::Vector3d& normal, const Eigen::Vector3d& up) {
  const double c = std::min(1.0, std::abs(normal.dot(up)));
  return std::min(std::acos(c), std::asin(c));
}

/// Returns whether a surface is nearer to horizontal than to vertical.
bool is_level(const Surfel& surfel, const Eigen::Vector3d& up) {
  return std::abs(surfel.normal.dot(up)) > 0.7;
}

/// Returns unit vectors at up to `largest` from a direction, kSearchStep apart.
Directions directions_around(const Eigen::Vector3d& middle, double largest) {
  const Eigen::Vector3d x = middle.unitOrthogonal(), y = middle.cross(x);
  Directions directions{middle};
  for (double tilt = kSearchStep; tilt <= largest; tilt += kSearchStep) {
    const int count =
        std::max(6, static_cast<int>(2 * std::numbers::pi * std::sin(tilt) / kSearchStep));
    for (int i = 0; i < count; ++i) {
      const double azimuth = 2 * std::numbers::pi * i / count;
      directions.push_back(std::cos(tilt) * middle +
                           std::sin(tilt) * (std::cos(azimuth) * x + std::sin(azimuth) * y));
    }
  }
  return directions;
}

/// Returns the logarithm of the probability density of the cameras' roll, relative to its maximum.
double log_roll_prior(const Eigen::Vector3d& up, const std::vector<Pose>& cameras) {
  double squares = 0;
  for (const Pose& T : cameras) {
    const double roll = std::asin(std::clamp(up.dot(T.rotation().col(0)), -1.0, 1.0));
    squares += roll * roll / (kRollSigma * kRollSigma);
  }
  return -0.5 * squares / static_cast<double>(std::max<std::size_t>(1, cameras.size()));
}

/// Returns the mean viewing direction.
Eigen::Vector3d mean_view(const std::vector<Pose>& cameras) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose& T : cameras) sum += T.rotation().col(2);
  return sum / static_cast<double>(std::max<std::size_t>(1, cameras.size()));
}

/// Returns how well surfaces support a direction: the logarithm of its likelihood relative to that
/// of surfaces of random direction, for every `step`-th surfel.
double support(const std::vector<Surfel>& surfels, std::size_t step, const Eigen::Vector3d& up) {
  double sum = 0;
  for (std::size_t i = 0; i < surfels.size(); i += step) {
    const double relative = angle_from_horizontal_or_vertical(surfels[i].normal, up) / kSearchGate;
    sum += (is_level(surfels[i], up) ? kHorizontalWeight : kVerticalWeight) *
           std::max(0.0, 1 - relative * relative);
  }
  return sum * static_cast<double>(step) * kSurfelArea / kVote;
}

/// A direction of the search.
struct Candidate {
  Eigen::Vector3d up;
  double score = 0;  // logarithm of the probability, up to a constant
};

std::vector<Candidate> candidates(const std::vector<Surfel>& surfels,
                                  const std::vector<Pose>& cameras) {
  const std::size_t step = 1 + surfels.size() / kSearchSurfels;
  const Eigen::Vector3d view = mean_view(cameras);
  std::vector<Candidate> found;
  for (const Eigen::Vector3d& up : directions_around(mean_up(cameras), kLargestPitch)) {
    if (up.dot(view) > std::sin(kLargestUpwardView)) continue;
    found.push_back({up, support(surfels, step, up) + log_roll_prior(up, cameras)});
  }
  return found;
}

/// Returns the most probable direction of the search; none if others are too probable.
std::optional<Eigen::Vector3d> best_direction(const std::vector<Surfel>& surfels,
                                              const std::vector<Pose>& cameras) {
  const std::vector<Candidate> found = candidates(surfels, cameras);
  const auto best = std::ranges::max_element(found, {}, &Candidate::score);
  if (best == found.end()) return std::nullopt;
  double same = 0, others = 0;
  for (const Candidate& c : found)
    (c.up.dot(best->up) > std::cos(kSameDirection) ? same : others) +=
        std::exp(c.score - best->score);
  return same > kCertainOdds * others ? std::optional(best->up) : std::nullopt;
}

/// Returns the direction to which the surfaces near horizontal are perpendicular and those near
/// vertical are parallel, by least squares; none if few surfaces show it.
std::optional<Eigen::Vector3d> refined(const std::vector<Surfel>& surfels, Eigen::Vector3d up) {
  for (const double gate : kGates) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    int count = 0;
    for (const Surfel& s : surfels) {
      if (angle_from_horizontal_or_vertical(s.normal, up) > gate) continue;
      const Eigen::Matrix3d outer = s.normal * s.normal.transpose();
      normal += is_level(s, up) ? Eigen::Matrix3d(Eigen::Matrix3d::Identity() - outer) : outer;
      ++count;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(normal);
    Eigen::Vector3d better = solver.eigenvectors().col(0);
    if (better.dot(up) < 0) better = -better;
    if (count < 10 || better.dot(up) < std::cos(2 * gate)) return std::nullopt;
    up = better;
  }
  return up;
}

/// The linear equations of a patch for a correction of the upward direction, in two coordinates
/// across it.
struct Patch {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
};
/// A patch: the cube, the axis nearest to the normals, and whether they are near `up`.
using PatchKey = std::array<int, 5>;

PatchKey patch_of(const Surfel& surfel, bool level) {
  Eigen::Index axis = 0;
  surfel.normal.cwiseAbs().maxCoeff(&axis);
  const Eigen::Vector3i cube = (surfel.point / kPatch).array().floor().cast<int>();
  return {cube.x(), cube.y(), cube.z(), static_cast<int>(axis), level};
}

std::map<PatchKey, Patch> patches(const std::vector<Surfel>& surfels, const Eigen::Vector3d& up) {
  Eigen::Matrix<double, 2, 3> across;
  across.row(0) = up.unitOrthogonal();
  across.row(1) = up.cross(up.unitOrthogonal());
  std::map<PatchKey, Patch> found;
  for (const Surfel& s : surfels) {
    if (angle_from_horizontal_or_vertical(s.normal, up) > kSearchGate) continue;
    const bool level = is_level(s, up);
    const double c = s.normal.dot(up);
    const Eigen::Vector2d n = across * s.normal;
    Patch& patch = found[patch_of(s, level)];
    patch.normal += level ? Eigen::Matrix2d(Eigen::Matrix2d::Identity()) : n * n.transpose();
    patch.right += level ? Eigen::Vector2d(c > 0 ? n : -n) : Eigen::Vector2d(-c * n);
  }
  return found;
}

/// Returns the standard deviation of the upward direction in its least certain direction [rad]. The
/// error of its least squares is that of the patches, each with an error of its own: what it
/// deviates by from the others, and kPatchSigma.
double sigma_of(const std::vector<Surfel>& surfels, const Eigen::Vector3d& up) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero(), errors = Eigen::Matrix2d::Zero();
  for (const auto& [key, patch] : patches(surfels, up)) {
    normal += patch.normal;
    errors += patch.right * patch.right.transpose() +
              kPatchSigma * kPatchSigma * patch.normal * patch.normal;
  }
  if (normal.determinant() < 1e-9) return std::numbers::pi;
  const Eigen::Matrix2d covariance = normal.inverse() * errors * normal.inverse();
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvalues().maxCoeff());
}

/// Returns the sum of the counts of the bins up to `reach` from a bin.
int count_around(const std::map<int, int>& histogram, int bin, int reach) {
  int count = 0;
  for (auto i = histogram.lower_bound(bin - reach); i != histogram.end() && i->first <= bin + reach;
       ++i)
    count += i->second;
  return count;
}

bool faces_up(const Surfel& surfel, const Eigen::Vector3d& up) {
  return surfel.normal.dot(up) > std::cos(kLevelTilt);
}

/// Returns the heights of the horizontal surfaces that face upwards, ascending [m].
std::vector<double> levels_of(const std::vector<Surfel>& surfels, const Eigen::Vector3d& up) {
  constexpr double kBin = 0.01;
  const int reach = static_cast<int>(std::lround(kLevel / kBin));
  std::map<int, int> histogram;
  for (const Surfel& s : surfels) {
    if (faces_up(s, up)) ++histogram[static_cast<int>(std::floor(up.dot(s.point) / kBin))];
  }
  std::vector<double> levels;
  for (const auto& [bin, unused] : histogram) {
    const int count = count_around(histogram, bin, reach);
    if (count * kSurfelArea < kMinLevelArea) continue;
    // The fullest one of the bins around it; of equal ones the lowest.
    bool highest = true;
    for (auto other = histogram.lower_bound(bin - 2 * reach);
         other != histogram.end() && other->first <= bin + 2 * reach && highest; ++other) {
      const int others = count_around(histogram, other->first, reach);
      highest = others < count || (others == count && other->first >= bin);
    }
    if (highest) levels.push_back((bin + 0.5) * kBin);
  }
  return levels;
}

/// Returns the extent of points of a plane in its narrow direction, as if they filled a rectangle
/// evenly [m].
double width_of(const Directions& points, const Eigen::Vector3d& up) {
  const Eigen::Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const auto& p : points) {
    const Eigen::Vector2d q(x.dot(p), y.dot(p));
    mean += q;
    moments += q * q.transpose();
  }
  mean /= static_cast<double>(points.size());
  moments = moments / static_cast<double>(points.size()) - mean * mean.transpose();
  return std::sqrt(12 * std::max(0.0, moments.selfadjointView<Eigen::Lower>().eigenvalues()(0)));
}

/// Returns the level at a height with its evidence.
FloorFinding measured(const std::vector<Surfel>& surfels, const Eigen::Vector3d& up, double height,
                      const Pose& camera) {
  Directions on;
  std::vector<double> heights;
  std::size_t below = 0;
  for (const Surfel& s : surfels) {
    const double above = up.dot(s.point) - height;
    if (above < -kBelow) ++below;
    if (std::abs(above) > kLevel || !faces_up(s, up)) continue;
    on.push_back(s.point);
    heights.push_back(up.dot(s.point));
  }
  const double middle = upper_median(heights);
  FloorFinding finding{.floor = Floor{up, middle}, .up = up};
  finding.evidence = {.area = static_cast<double>(on.size()) * kSurfelArea,
                      .width = width_of(on, up),
                      .area_below = static_cast<double>(below) * kSurfelArea,
                      .camera_height = up.dot(camera.translation()) - middle};
  return finding;
}

/// Returns the confidence of a floor [0..1]: the product of one term for each kind of evidence.
double confidence_of(const FloorEvidence& evidence) {
  const double wanted = evidence.camera_height < kHigh ? kWiderThanATable : kMinWidth;
  const double by_area = evidence.area / (evidence.area + kHalfCertainArea);
  const double by_width = std::min(1.0, evidence.width / wanted);
  const double by_depth = std::exp(-kBelowWeight * evidence.area_below / evidence.area);
  return by_area * by_width * by_width * by_depth;
}

std::string reason_against(const FloorFinding& finding) {
  const FloorEvidence& e = finding.evidence;
  return fmt::format(
      "the lowest large horizontal surface ({:.2f} m below the first camera) is no certain floor: "
      "confidence {:.2f}; {:.2f} m^2 of it were observed, {:.1f} m wide, and {:.2f} m^2 of other "
      "surfaces lie below it",
      e.camera_height, finding.confidence, e.area, e.width, e.area_below);
}

/// Returns the level of the highest confidence, or the reason why none is the floor.
FloorFinding most_certain_level(const std::vector<Surfel>& surfels, const Eigen::Vector3d& up,
                                const Pose& camera) {
  FloorFinding best{.up = up, .reason = "no large horizontal surface was observed"};
  for (const double height : levels_of(surfels, up)) {
    FloorFinding level = measured(surfels, up, height, camera);
    if (level.evidence.camera_height <= 0) continue;
    level.confidence = confidence_of(level.evidence);
    if (!best.floor || level.confidence > best.confidence) best = std::move(level);
  }
  if (best.floor && best.confidence < kCertain) {
    best.reason = reason_against(best);
    best.floor.reset();
  }
  return best;
}

/// Returns the direction that surfaces show near that of gravity, or gravity's.
FloorFinding upward_by(const Eigen::Vector3d& gravity, const std::vector<Surfel>& surfels) {
  const auto up = refined(surfels, gravity);
  if (!up || up->dot(gravity) < std::cos(kGravityGate))
    return {.up = gravity, .up_sigma = kGravitySigma};
  return {.up = up, .up_sigma = std::min(kGravitySigma, sigma_of(surfels, *up))};
}

/// Returns a finding with the upward direction, given or estimated, or the reason why it is
/// unknown.
FloorFinding upward(const std::vector<Surfel>& surfels, const std::vector<Pose>& cameras,
                    const FloorHints& hints) {
  if (hints.up) return {.up = (cameras.front().quaternion() * *hints.up).normalized()};
  if (hints.gravity) return upward_by(*hints.gravity, surfels);
  const auto near = best_direction(surfels, cameras);
  const auto up = near ? refined(surfels, *near) : std::nullopt;
  if (!up) return {.reason = "too few walls and horizontal surfaces show the upward direction"};
  return {.up = up, .up_sigma = sigma_of(surfels, *up)};
}

/// Returns whether a certain floor is above the camera, as in the images of one that is upside
/// down, or of one that sees only the ceiling.
bool is_upside_down(const std::vector<Surfel>& surfels, const Eigen::Vector3d& up,
                    const Pose& camera) {
  return most_certain_level(surfels, -up, camera).floor.has_value();
}

/// Returns the poses of cameras whose images are those of the given ones turned clockwise.
std::vector<Pose> with_turned_images(std::vector<Pose> cameras, int degrees) {
  const Pose turn(so3_exp({0, 0, -degrees * kDegree}), Eigen::Vector3d::Zero());
  for (Pose& T : cameras) T = T * turn;
  return cameras;
}

/// Returns the logarithm of the probability of the most probable upward direction, up to a
/// constant.
double best_score(const std::vector<Surfel>& surfels, const std::vector<Pose>& cameras) {
  double best = -std::numeric_limits<double>::infinity();
  for (const Candidate& c : candidates(surfels, cameras)) best = std::max(best, c.score);
  return best;
}

/// Returns the clockwise rotation by which the images may become upright, 90 or 270 degrees. There
/// is one if the turned images show a certain floor whose upward direction is far more probable
/// than any direction of the given images. A large wall at the side of the camera looks the same.
std::optional<int> turn_of_images(const std::vector<Surfel>& surfels,
                                  const std::vector<Pose>& cameras) {
  const double least = best_score(surfels, cameras) + std::log(kUprightOdds * kCertainOdds);
  for (const int degrees : {90, 270}) {
    const std::vector<Pose> turned = with_turned_images(cameras, degrees);
    if (best_score(surfels, turned) < least) continue;
    const FloorFinding found = upward(surfels, turned, {});
    if (!found.up || found.up_sigma > kLargestSigma) continue;
    if (most_certain_level(surfels, *found.up, cameras.front()).floor) return degrees;
  }
  return std::nullopt;
}

std::string uncertain_direction_text(double sigma) {
  return fmt::format(
      "the walls and horizontal surfaces show the upward direction only within {:.1f} degrees "
      "(95 %), and {:.1f} are needed",
      2 * sigma / kDegree, 2 * kLargestSigma / kDegree);
}

}  // namespace

FloorFinding find_floor(const std::vector<Surfel>& surfels, const std::vector<Pose>& cameras,
                        const FloorHints& hints) {
  if (hints.floor) return {.floor = hints.floor, .up = hints.floor->up, .confidence = 1};
  if (cameras.empty()) return {.reason = "there is no view"};
  FloorFinding finding = upward(surfels, cameras, hints);
  const bool upright = hints.up || hints.gravity;
  const double sigma = finding.up_sigma;
  if (finding.up && hints.camera_height) {
    const Eigen::Vector3d& eye = cameras.front().translation();
    finding.confidence = 1;
    finding.floor = Floor{*finding.up, finding.up->dot(eye) - *hints.camera_height};
    finding.evidence.camera_height = *hints.camera_height;
  } else if (finding.up) {
    finding = most_certain_level(surfels, *finding.up, cameras.front());
    finding.up_sigma = sigma;
    if (!finding.floor && !upright && is_upside_down(surfels, *finding.up, cameras.front())) {
      finding = {.reason =
                     "a large horizontal surface is above the camera and none below: the images "
                     "may be upside down (turn them with --rotate 180), or show the ceiling "
                     "only"};
    }
  }
  if (finding.floor && sigma > kLargestSigma) {
    finding.floor.reset();
    finding.reason = uncertain_direction_text(sigma);
  }
  if (!finding.floor && !upright) {
    if (const auto degrees = turn_of_images(surfels, cameras))
      finding.reason +=
          fmt::format("; if the images are turned, turn them with --rotate {}", *degrees);
  }
  return finding;
}

double wall_direction(const std::vector<Surfel>& surfels, const Pose& T_map_world) {
  // The mean of angles that repeat every 90 degrees.
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Surfel& s : surfels) {
    const Eigen::Vector3d n = T_map_world.quaternion() * s.normal;
    if (std::abs(n.z()) > std::sin(kLevelTilt)) continue;
    const double angle = 4 * std::atan2(n.y(), n.x());
    sum += Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return sum.norm() > 0 ? std::atan2(sum.y(), sum.x()) / 4 : 0;
}

bool is_upright(const Eigen::Vector3d& up) { return up.z() > std::cos(2 * kDegree); }

Pose map_frame(const Floor& floor, const Pose& T_world_camera) {
  const Eigen::Vector3d& eye = T_world_camera.translation();
  const Eigen::Vector3d below = eye - (floor.up.dot(eye) - floor.height) * floor.up;
  if (is_upright(floor.up)) return {Eigen::Matrix3d::Identity(), {0, 0, -below.z()}};
  const Eigen::Matrix3d R_camera = T_world_camera.rotation();
  const auto level = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v - floor.up.dot(v) * floor.up);
  };
  Eigen::Vector3d ahead = level(R_camera.col(2));
  if (ahead.norm() < 0.2) ahead = level(-R_camera.col(1));  // the camera looks straight down or up
  Eigen::Matrix3d R_map_world;
  R_map_world.row(0) = ahead.normalized();
  R_map_world.row(2) = floor.up;
  R_map_world.row(1) = floor.up.cross(ahead.normalized());
  return {R_map_world, -(R_map_world * below)};
}

Eigen::Matrix3d upright_axes(const FloorFinding& finding, const std::vector<Surfel>& surfels,
                             const std::vector<Pose>& cameras) {
  const Eigen::Vector3d up = finding.up.value_or(mean_up(std::span(cameras)));
  const Pose first = cameras.empty() ? Pose() : cameras.front();
  const Eigen::Matrix3d R = map_frame({.up = up}, first).rotation();
  const double walls = wall_direction(surfels, Pose(R, Eigen::Vector3d::Zero()));
  return Eigen::AngleAxisd(-walls, Eigen::Vector3d::UnitZ()).toRotationMatrix() * R;
}

}  // namespace stillmap
