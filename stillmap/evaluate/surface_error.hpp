// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/ghosts.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

struct SurfaceErrorOptions {
  double reach = 0.1;    ///< a point of the cloud farther from the true surface is stray [m]
  double patch = 0.025;  ///< radius of the patch that a true point's normal is fitted to [m]
  int min_frames = 3;    ///< what fewer frames saw does not count as visible
  int mask_margin = 6;   ///< nor what was this near to a mask [pixels]
  int stride = 2;        ///< every n-th true point is judged for what was visible and is there
};

/// Points and "which is nearest?".
class NearestPoint {
 public:
  /// Points that are not finite are left out. @param reach farthest that is looked for [m]
  NearestPoint(std::vector<Eigen::Vector3f> points, double reach);
  struct Found {
    std::uint32_t index;  ///< of the point
    float distance;       ///< [m]
  };
  /// The nearest point within reach; of equally near ones the first.
  std::optional<Found> find(const Eigen::Vector3f& p) const;
  /// All points within `radius`, which is at most the reach [m].
  std::vector<std::uint32_t> around(const Eigen::Vector3f& p, float radius) const;
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

 private:
  std::vector<Eigen::Vector3f> points_;
  double reach_, cell_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// How near a cloud comes to the true surface, and how much of it.
struct SurfaceFigures {
  std::size_t points = 0;      ///< of the cloud
  double median = 0, p95 = 0;  ///< distance of the cloud's points to the true surface [m]
  double stray_share = 0;      ///< of the cloud's points are farther than `reach` from it
  std::size_t visible = 0;     ///< points of the true surface that were ever visible
  double complete_2cm = 0;     ///< share of these with a point of the cloud within 2 cm
  double complete_5cm = 0;     ///< within 5 cm
  double sensor_median = 0, sensor_p95 = 0;  ///< error of single depth measurements of it [m]
};

/// The true static surface as points no farther than about a centimeter apart (a simulator knows
/// it), and which of them a sequence ever showed.
class TrueSurface {
 public:
  /// @param points in the truth's world [m]; throws Error if there are none
  explicit TrueSurface(std::vector<Eigen::Vector3f> points,
                       const SurfaceErrorOptions& options = {});

  /// Counts the points that a frame sees: they fall on a pixel outside of all masks whose measured
  /// depth agrees within 2 cm and three standard deviations of the sensor. Points whose depth the
  /// sensor measures with a standard deviation above 2.2 cm, a Kinect v1's at 4 m, do not count.
  void look(const MaskedFrame& frame, const Pose& T_world_camera, const Camera& camera);

  /// The figures of a cloud. The distance to the surface is that to the plane through the nearest
  /// true point along its normal, so that it does not depend on how dense the true points are;
  /// beside a border of the surface it is the distance to the point. Stray points count with
  /// `reach`.
  /// @param points           in the estimate's world [m]
  /// @param T_truth_estimate the estimate's world in the truth's, as AteResult gives it
  SurfaceFigures judge(std::span<const Eigen::Vector3f> points, const Pose& T_truth_estimate) const;

 private:
  double distance(const Eigen::Vector3f& p) const;
  Eigen::Vector3f normal(std::uint32_t index) const;

  SurfaceErrorOptions options_;
  NearestPoint index_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<std::uint16_t> frames_;         // that saw each point
  std::vector<std::uint32_t> sensor_errors_;  // histogram of |measured - true|, kBins per reach
};

/// One line of text per figure.
std::string surface_text(const SurfaceFigures& figures);
void to_json(nlohmann::json& json, const SurfaceFigures& figures);

}  // namespace stillmap
