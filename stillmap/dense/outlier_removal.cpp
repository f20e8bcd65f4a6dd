// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/outlier_removal.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr float kNoPoint = -1;
constexpr float kAlone = std::numeric_limits<float>::infinity();

// The points as one plane per coordinate, with a border of empty points (z = 0) as wide as the
// window.
struct Planes {
  cv::Mat1f x, y, z;
};

Planes padded_planes(const cv::Mat3f& points, int border) {
  cv::Mat3f padded;
  cv::copyMakeBorder(points, padded, border, border, border, border, cv::BORDER_CONSTANT);
  std::array<cv::Mat1f, 3> planes;
  cv::split(padded, planes.data());
  return {.x = planes[0], .y = planes[1], .z = planes[2]};
}

// The k smallest squared distances of every point of one grid row, as k rows in ascending order.
// All loops run along the row, so that the compiler turns them into vector instructions.
class NearestOfRow {
 public:
  NearestOfRow(int cols, int k) : distance_(1, cols), nearest_(k, cols) {}

  void reset() { nearest_.setTo(kAlone); }

  // Adds the distances from the points of `row` to those at an offset of (d_row, d_col).
  void add_offset(const Planes& p, int window, int row, int d_row, int d_col) {
    measure(p, window, row, d_row, d_col);
    insert();
  }

  // Writes the mean distance to the k nearest points, infinite for fewer.
  void write_means(float* mean) const {
    std::fill(mean, mean + nearest_.cols, 0.0F);
    for (int i = 0; i < nearest_.rows; ++i) {
      const float* squared = nearest_[i];
      for (int c = 0; c < nearest_.cols; ++c) mean[c] += std::sqrt(squared[c]);
    }
    for (int c = 0; c < nearest_.cols; ++c) mean[c] /= static_cast<float>(nearest_.rows);
  }

 private:
  void measure(const Planes& p, int window, int row, int d_row, int d_col) {
    const int from = row + window, to = from + d_row, shift = window + d_col;
    const float *x = p.x[from] + window, *y = p.y[from] + window, *z = p.z[from] + window;
    const float *xn = p.x[to] + shift, *yn = p.y[to] + shift, *zn = p.z[to] + shift;
    float* distance = distance_[0];
    for (int c = 0; c < distance_.cols; ++c) {
      const float dx = x[c] - xn[c], dy = y[c] - yn[c], dz = z[c] - zn[c];
      const float squared = dx * dx + dy * dy + dz * dz;
      distance[c] = zn[c] > 0 ? squared : kAlone;
    }
  }

  // One step of insertion sort in every column.
  void insert() {
    float* inserted = distance_[0];
    for (int i = 0; i < nearest_.rows; ++i) {
      float* kept = nearest_[i];
      for (int c = 0; c < nearest_.cols; ++c) {
        const float smaller = std::min(kept[c], inserted[c]);
        inserted[c] = std::max(kept[c], inserted[c]);
        kept[c] = smaller;
      }
    }
  }

  cv::Mat1f distance_, nearest_;
};

// Returns per grid cell the mean distance to the k nearest neighbors over depth, kAlone or
// kNoPoint.
cv::Mat1f neighbor_distances(const cv::Mat3f& points, const OutlierOptions& options) {
  const int window = options.window;
  const Planes planes = padded_planes(points, window);
  NearestOfRow nearest(points.cols, options.neighbors);
  cv::Mat1f distances(points.size());
  for (int row = 0; row < points.rows; ++row) {
    nearest.reset();
    for (int d_row = -window; d_row <= window; ++d_row) {
      for (int d_col = -window; d_col <= window; ++d_col) {
        if (d_row != 0 || d_col != 0) nearest.add_offset(planes, window, row, d_row, d_col);
      }
    }
    nearest.write_means(distances[row]);
    const float* z = planes.z[row + window] + window;
    for (int c = 0; c < points.cols; ++c) {
      distances(row, c) = z[c] > 0 ? distances(row, c) / z[c] : kNoPoint;
    }
  }
  return distances;
}

// Returns mean + deviations * standard deviation of the finite distances.
float outlier_threshold(const cv::Mat1f& distances, double deviations) {
  double sum = 0, sum_of_squares = 0, n = 0;
  for (const float d : distances) {
    if (d == kNoPoint || d == kAlone) continue;
    sum += d;
    sum_of_squares += double{d} * d;
    n += 1;
  }
  if (n == 0) return kAlone;
  const double mean = sum / n;
  const double variance = std::max(0.0, sum_of_squares / n - mean * mean);
  return static_cast<float>(mean + deviations * std::sqrt(variance));
}

}  // namespace

std::size_t remove_outliers(PointGrid& grid, const OutlierOptions& options) {
  const TraceScope scope("outliers");
  if (options.neighbors == 0) return 0;
  const cv::Mat1f distances = neighbor_distances(grid.points, options);
  const float threshold = outlier_threshold(distances, options.deviations);

  std::size_t removed = 0;
  for (int row = 0; row < distances.rows; ++row) {
    for (int col = 0; col < distances.cols; ++col) {
      const float d = distances(row, col);
      if (d == kNoPoint || (d <= threshold && d != kAlone)) continue;
      grid.points(row, col) = {0, 0, 0};
      ++removed;
    }
  }
  return removed;
}

}  // namespace stillmap
