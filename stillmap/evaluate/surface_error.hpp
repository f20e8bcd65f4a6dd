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

/// Index of points for nearest neighbor queries.
class NearestPoint {
 public:
  /// Points that are not finite are ignored. @param reach largest distance of a query [m]
  NearestPoint(std::vector<Eigen::Vector3f> points, double reach);
  struct Found {
    std::uint32_t index;  ///< Index of the point.
    float distance;       ///< Distance to the point [m].
  };
  /// Returns the nearest point within reach; of equally near points the first.
  std::optional<Found> find(const Eigen::Vector3f& p) const;
  /// Returns all points within `radius` [m], which is at most the reach.
  std::vector<std::uint32_t> around(const Eigen::Vector3f& p, float radius) const;
  const std::vector<Eigen::Vector3f>& points() const { return points_; }

 private:
  std::vector<Eigen::Vector3f> points_;
  double reach_, cell_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// Accuracy and completeness of a cloud.
struct SurfaceFigures {
  std::size_t points = 0;      ///< Number of points in the cloud.
  double median = 0, p95 = 0;  ///< Distance of the cloud's points to the true surface [m].
  double stray_share = 0;      ///< Share of the points farther than 0.1 m from it [0..1].
  std::size_t visible = 0;     ///< Number of evaluated true points that were visible.
  double complete_2cm = 0;     ///< Share of these with a point of the cloud within 2 cm [0..1].
  double complete_5cm = 0;     ///< Share of these with a point of the cloud within 5 cm [0..1].
  double sensor_median = 0, sensor_p95 = 0;  ///< Error of single depth measurements [m].
};

/// The true static surface, as points at most about a centimeter apart (from a simulator), with the
/// number of frames that observed each of them.
class TrueSurface {
 public:
  /// @param points points in the truth's world [m]; throws Error if there are none
  explicit TrueSurface(std::vector<Eigen::Vector3f> points);

  /// Counts the frame for the points that it observes: they fall on a pixel outside of all masks
  /// whose measured depth agrees within 2 cm and three standard deviations of the sensor. Points
  /// with a standard deviation of the measured depth above 2.6 cm, that of a Kinect v1 at 4 m, do
  /// not count.
  void look(const MaskedFrame& frame, const Pose& T_world_camera, const Camera& camera);

  /// Returns the figures of a cloud. The distance to the surface is the distance to the plane
  /// through the nearest true point along its normal, so that it does not depend on the density of
  /// the true points; outside a border of the surface it is the distance to the point. Stray points
  /// count with 0.1 m.
  /// @param points           points in the estimate's world [m]
  /// @param T_truth_estimate transform from the estimate's world to the truth's: see align_worlds()
  SurfaceFigures judge(std::span<const Eigen::Vector3f> points, const Pose& T_truth_estimate) const;

 private:
  double distance(const Eigen::Vector3f& p) const;
  Eigen::Vector3f normal(std::uint32_t index) const;

  NearestPoint index_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<std::uint16_t> frames_;         // number of frames that observed each point
  std::vector<std::uint32_t> sensor_errors_;  // histogram of |measured - true|, kBins in kReach
};

/// Returns one line of text per figure.
std::string surface_text(const SurfaceFigures& figures);
void to_json(nlohmann::json& json, const SurfaceFigures& figures);

}  // namespace stillmap
