// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/tag_corners.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Upper bits of the number of a corner, by which it is told from other numbers.
constexpr std::uint64_t kMark = 0x7a65;
constexpr int kMarkShift = 48, kFamilyShift = 40, kIdShift = 8;

/// The finalizer of SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators,
/// OOPSLA 2014), a permutation of the 64-bit numbers.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
  x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
  return x ^ (x >> 31);
}

/// The inverse of mixed().
constexpr std::uint64_t unmixed(std::uint64_t x) {
  x = (x ^ (x >> 31) ^ (x >> 62)) * 0x319642b2d24d8ec3;
  x = (x ^ (x >> 27) ^ (x >> 54)) * 0x96de1b173f119089;
  return x ^ (x >> 30) ^ (x >> 60);
}
static_assert(unmixed(mixed(0x0123456789abcdef)) == 0x0123456789abcdef);

bool is_ignored(const cv::Mat& ignored, const cv::Point2f& p) {
  return !ignored.empty() && ignored.at<std::uint8_t>(cvRound(p.y), cvRound(p.x)) != 0;
}

/// A plane in the image of a camera without distortion: 1 / depth = slope . (u, v, 1).
using InversePlane = Eigen::Vector3d;

/// Returns the plane of depths within a tag, by least squares without the readings that it fits
/// worst; none if fewer than half of the pixels have a depth.
std::optional<InversePlane> plane_of(const Tag& tag, const cv::Mat& depth) {
  constexpr double kMaxDeviation = 0.1;  // of a reading from the plane, relative
  constexpr int kRounds = 3, kFewest = 20;
  std::vector<cv::Point> corners(tag.corners.begin(), tag.corners.end());
  const cv::Rect box = cv::boundingRect(corners) & cv::Rect({}, depth.size());
  for (cv::Point& corner : corners) corner -= box.tl();
  cv::Mat inside(box.size(), CV_8UC1, cv::Scalar(0));
  cv::fillConvexPoly(inside, corners, 1);
  std::vector<Eigen::Vector4d> readings;  // u, v, 1, 1 / depth
  int pixels = 0;
  for (int v = box.y; v < box.br().y; ++v) {
    for (int u = box.x; u < box.br().x; ++u) {
      if (inside.at<std::uint8_t>(v - box.y, u - box.x) == 0) continue;
      ++pixels;
      const float z = depth.at<float>(v, u);
      if (std::isfinite(z) && z > 0) readings.emplace_back(u, v, 1, 1 / z);
    }
  }
  std::optional<InversePlane> plane;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    int used = 0;
    for (const Eigen::Vector4d& r : readings) {
      const Eigen::Vector3d at = r.head<3>();
      if (plane && std::abs(plane->dot(at) - r[3]) > kMaxDeviation * r[3]) continue;
      H += at * at.transpose();
      b += at * r[3];
      ++used;
    }
    if (used < std::max(kFewest, pixels / 2)) return std::nullopt;
    plane = H.ldlt().solve(b);
  }
  return plane;
}

/// Returns the depth of a tag's plane at a corner [m], 0 if it is unknown.
float depth_on(const std::optional<InversePlane>& plane, const cv::Point2f& p) {
  if (!plane) return 0;
  const double inverse = plane->dot(Eigen::Vector3d(p.x, p.y, 1));
  return inverse > 0 ? static_cast<float>(1 / inverse) : 0;
}

bool contains(const cv::Mat& image, const cv::Point2f& p) {
  return cvRound(p.x) >= 0 && cvRound(p.x) < image.cols && cvRound(p.y) >= 0 &&
         cvRound(p.y) < image.rows;
}

}  // namespace

Descriptor descriptor_of(const TagCorner& corner) {
  const std::uint64_t number =
      kMark << kMarkShift | static_cast<std::uint64_t>(corner.tag.family) << kFamilyShift |
      static_cast<std::uint64_t>(corner.tag.id) << kIdShift | corner.corner;
  constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15;  // that of SplitMix64
  return {mixed(number), mixed(number + kStep), mixed(number + 2 * kStep),
          mixed(number + 3 * kStep)};
}

std::optional<TagCorner> tag_corner_of(const Descriptor& descriptor) {
  const std::uint64_t number = unmixed(descriptor[0]);
  if (number >> kMarkShift != kMark) return std::nullopt;
  const TagCorner corner{{static_cast<std::uint8_t>(number >> kFamilyShift),
                          static_cast<std::uint32_t>(number >> kIdShift)},
                         static_cast<std::uint8_t>(number)};
  if (corner.corner > 3 || descriptor_of(corner) != descriptor) return std::nullopt;
  return corner;
}

Features with_tag_corners(Features features, std::span<const Tag> tags, const cv::Mat& depth,
                          const cv::Mat& ignored) {
  if (tags.empty()) return features;
  for (const Tag& tag : tags) {
    const bool visible = std::ranges::all_of(tag.corners, [&](const cv::Point2f& p) {
      return contains(depth, p) && !is_ignored(ignored, p);
    });
    if (!visible) continue;
    const auto plane = plane_of(tag, depth);
    const cv::Point2f bottom = tag.corners[1] - tag.corners[0];
    for (std::size_t i = 0; i < tag.corners.size(); ++i) {
      const cv::Point2f& p = tag.corners[i];
      features.keypoints.push_back({.u = p.x,
                                    .v = p.y,
                                    .angle = std::atan2(bottom.y, bottom.x),
                                    .depth = depth_on(plane, p)});
      features.descriptors.push_back(descriptor_of({tag.name, static_cast<std::uint8_t>(i)}));
    }
  }
  features.grid = KeypointGrid(features.keypoints, depth.cols, depth.rows);
  return features;
}

}  // namespace stillmap
