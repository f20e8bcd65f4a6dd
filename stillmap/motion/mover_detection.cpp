// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_detection.hpp"

#include "stillmap/base/disjoint_sets.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/depth_visibility.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kNoInstance = -1;
constexpr double kNearest = 0.1;   // least depth at which a view is compared with a point [m]
constexpr std::size_t kSpeck = 4;  // cells: fewer are noise, not even a piece of something

/// Neighboring cells belong to one object while their depths differ by less than five
/// standard deviations of a reading, and a step within one object, such as from an arm to the trunk
/// [m].
constexpr double kJumpSigmas = 5, kJumpFloor = 0.12;

/// Standard deviation of a depth up to which movers are detected [m]: that of a Kinect v1 at the
/// end of its range.
constexpr double kMaxSigma = 0.1;

DepthPolynomial<double> jump_of(const Camera& camera) {
  return camera.depth_sensor.tolerance<double>(kJumpSigmas, kJumpFloor);
}

/// What of the frame's cells is looked at.
struct Grid {
  const CellGrid& cells;
  cv::Mat1b moves;     // 0 or 255
  cv::Mat1f depth;     // meters; 0: none, or not of interest
  cv::Mat1i instance;  // index, or kNoInstance
  DepthPolynomial<double> jump = jump_of(cells.camera);
  const Camera& camera() const { return cells.camera; }
};

/// A set of cells that moves as one.
struct Region {
  std::vector<cv::Point> cells;
  std::vector<Eigen::Vector3d> points;  // camera frame, one per cell
  Eigen::AlignedBox3d box;              // around them, camera frame
};

/// The middle pixel of a cell.
cv::Point pixel_of(int column, int row) {
  return {column * kCellSide + kCellSide / 2, row * kCellSide + kCellSide / 2};
}

/// Without the cells at the rim; beyond the image's border it is taken to go on.
cv::Mat1b without_rim(const cv::Mat1b& cells) {
  cv::Mat1b inner;
  cv::erode(cells, inner, cv::Mat::ones(3, 3, CV_8UC1), cv::Point(-1, -1), 1, cv::BORDER_CONSTANT,
            cv::Scalar(255));
  return inner;
}

/// Which cells each instance covers; where two do, the one listed first has it.
cv::Mat1i instance_of_cells(const InstanceCellsPtr& cells, cv::Size grid) {
  cv::Mat1i instance(grid, kNoInstance);
  if (!cells) return instance;
  for (int i = static_cast<int>(cells->size()) - 1; i >= 0; --i)
    instance.setTo(i, (*cells)[static_cast<std::size_t>(i)]);
  return instance;
}

/// Cells that show moving pixels: 255.
cv::Mat1b moving_cells(const Frame& frame) {
  cv::Mat1b moves(frame.cells->size(), 0);
  const cv::Mat& pixels = frame.evidence.moving_pixels;
  if (pixels.empty()) return moves;
  for (int y = 0; y < moves.rows; ++y) {
    for (int x = 0; x < moves.cols; ++x) moves(y, x) = pixels.at<std::uint8_t>(pixel_of(x, y));
  }
  return moves;
}

/// Cells within the mask of an instance that was measured to move, but that were themselves
/// measured to stand: background that the mask takes in, 255. A share of `min_moving` of the
/// instance's cells must have been measured to move, else it may be somebody who stands still.
cv::Mat1b standing_within_instances(const cv::Mat1i& instance, const MotionEvidence& evidence,
                                    const MoverDetectionOptions& options) {
  cv::Mat1b standing(instance.size(), 0);
  if (evidence.surface_measured.empty()) return standing;
  double count = 0;
  cv::minMaxLoc(instance, nullptr, &count);
  for (int i = 0; i <= static_cast<int>(count); ++i) {
    const cv::Mat1b within = instance == i;
    const cv::Mat1b moving = within & (evidence.surface_measured < options.grow_below);
    if (cv::countNonZero(moving) >= options.min_moving * cv::countNonZero(within))
      standing |= within & (evidence.surface_measured > 0);
  }
  return standing;
}

/// What may belong to a mover.
/// @param background 255 where a cell is known not to
Grid make_grid(const Frame& frame, const cv::Mat1b& moves, const cv::Mat1b& background,
               const MoverDetectionOptions& options) {
  const CellGrid& cells = *frame.cells;
  const cv::Mat1f& log_odds = frame.evidence.surface_log_odds;
  Grid grid{cells, moves & ~background, cells.depth.clone(),
            instance_of_cells(frame.instance_cells, cells.size())};
  cv::Mat1b part = moves | (grid.instance != kNoInstance);
  if (!log_odds.empty()) part |= log_odds < options.grow_below;
  part &= ~standing_within_instances(grid.instance, frame.evidence, options);
  const cv::Mat1b too_far = grid.depth > cells.camera.depth_sensor.depth_at_sigma(kMaxSigma);
  grid.depth.setTo(0, ~part | background | too_far);
  return grid;
}

bool same_thing(const Grid& grid, cv::Point a, cv::Point b) {
  const float depth_a = grid.depth(a), depth_b = grid.depth(b);
  if (depth_a == 0 || depth_b == 0) return false;
  if (grid.instance(a) != grid.instance(b)) return false;
  const double depth = std::min(depth_a, depth_b);
  return std::abs(depth_a - depth_b) < grid.jump.at(depth);
}

std::vector<Region> connected_regions(const Grid& grid) {
  const int width = grid.depth.cols, height = grid.depth.rows;
  const auto number = [&](cv::Point p) { return static_cast<std::size_t>(p.y * width + p.x); };
  DisjointSets sets(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const cv::Point here(x, y);
      if (grid.depth(here) == 0) continue;
      for (const cv::Point step :
           {cv::Point(1, 0), cv::Point(0, 1), cv::Point(2, 0), cv::Point(0, 2)}) {
        const cv::Point there = here + step;
        if (there.x < width && there.y < height && same_thing(grid, here, there))
          sets.unite(number(here), number(there));
      }
    }
  }
  std::map<std::size_t, Region> regions;  // by their first cell
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float z = grid.depth(y, x);
      if (z == 0) continue;
      Region& region = regions[sets.root(number({x, y}))];
      region.cells.emplace_back(x, y);
      region.points.push_back(grid.camera().unproject(x, y, z));
    }
  }
  std::vector<Region> result;
  for (auto& [first, region] : regions) {
    if (region.cells.size() >= kSpeck) result.push_back(std::move(region));
  }
  return result;
}

/// Mean of the values without the `trim` smallest and largest shares, and those limits.
struct Trimmed {
  double mean = 0, low = 0, high = 0;
};
Trimmed trimmed(std::vector<double>& values, double trim) {
  const auto count = static_cast<std::ptrdiff_t>(values.size());
  const auto cut =
      std::min(static_cast<std::ptrdiff_t>(trim * static_cast<double>(count)), (count - 1) / 2);
  std::nth_element(values.begin(), values.begin() + cut, values.end());
  const double low = values[static_cast<std::size_t>(cut)];
  std::nth_element(values.begin() + cut, values.end() - 1 - cut, values.end());
  const double high = values[static_cast<std::size_t>(count - 1 - cut)];
  const double sum = std::accumulate(values.begin() + cut, values.end() - cut, 0.0);
  return {sum / static_cast<double>(count - 2 * cut), low, high};
}

/// Trimmed box and mean of points.
struct Spread {
  Eigen::Vector3d mean;
  Eigen::AlignedBox3d box;
};
Spread spread_of(const std::vector<Eigen::Vector3d>& points, double trim) {
  Spread spread;
  Eigen::Vector3d low, high;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [&](const auto& p) { return p(axis); });
    const Trimmed t = trimmed(values, trim);
    spread.mean(axis) = t.mean;
    low(axis) = t.low;
    high(axis) = t.high;
  }
  spread.box = {low, high};
  return spread;
}

/// The instance that covers the most of a region, and the share it covers.
struct Cover {
  int instance = kNoInstance;
  double share = 0;
};
Cover cover_of(const Region& region, const Grid& grid) {
  std::map<int, int> cells_of;
  for (const cv::Point& cell : region.cells) ++cells_of[grid.instance(cell)];
  Cover cover;
  int most = 0;
  for (const auto& [instance, cells] : cells_of) {
    if (instance == kNoInstance || cells <= most) continue;
    most = cells;
    cover = {instance, static_cast<double>(cells) / static_cast<double>(region.cells.size())};
  }
  return cover;
}

/// Share of a region's cells that move.
double moving_share(const Region& region, const Grid& grid) {
  const auto moving = std::count_if(region.cells.begin(), region.cells.end(),
                                    [&](cv::Point cell) { return grid.moves(cell) != 0; });
  return static_cast<double>(moving) / static_cast<double>(region.cells.size());
}

/// Whether two regions are pieces of one thing.
bool may_join(const Region& a, const Region& b, int instance_a, int instance_b,
              const MoverDetectionOptions& options) {
  const bool named = instance_a != kNoInstance && instance_b != kNoInstance;
  if (named && instance_a != instance_b) return false;
  const double between = std::abs(a.box.center().z() - b.box.center().z());
  if (between > options.piece_gap) return false;
  if (named) return true;
  if (a.box.exteriorDistance(b.box) > options.piece_gap) return false;
  const Eigen::Vector3d size = a.box.merged(b.box).sizes();
  return std::min(size.x(), size.y()) <= options.max_width &&
         std::max(size.x(), size.y()) <= options.max_length;
}

void absorb(Region& whole, Region& piece) {
  whole.cells.insert(whole.cells.end(), piece.cells.begin(), piece.cells.end());
  whole.points.insert(whole.points.end(), piece.points.begin(), piece.points.end());
  whole.box.extend(piece.box);
  piece.cells.clear();
  piece.points.clear();
}

/// Joins pieces until no two are left that may be.
void join_pieces(std::vector<Region>& regions, const Grid& grid,
                 const MoverDetectionOptions& options) {
  std::vector<int> instance;
  for (Region& region : regions) {
    region.box = spread_of(region.points, options.trim).box;
    instance.push_back(cover_of(region, grid).instance);
  }
  for (bool joined = true; joined;) {
    joined = false;
    for (std::size_t i = 0; i < regions.size(); ++i) {
      for (std::size_t k = i + 1; k < regions.size(); ++k) {
        if (regions[i].cells.empty() || regions[k].cells.empty()) continue;
        if (!may_join(regions[i], regions[k], instance[i], instance[k], options)) continue;
        absorb(regions[i], regions[k]);
        instance[i] = std::max(instance[i], instance[k]);
        joined = true;
      }
    }
  }
  std::erase_if(regions, [](const Region& region) { return region.cells.empty(); });
}

/// Leaves one region, the largest, of those that one instance covers: the others are background
/// that its mask, or its box, takes in.
void keep_largest_pieces(std::vector<Region>& regions, const Grid& grid) {
  std::map<int, std::size_t> cells_of_largest;
  for (const Region& region : regions) {
    auto& largest = cells_of_largest[cover_of(region, grid).instance];
    largest = std::max(largest, region.cells.size());
  }
  cells_of_largest[kNoInstance] = 0;
  std::erase_if(regions, [&](const Region& region) {
    return region.cells.size() < cells_of_largest[cover_of(region, grid).instance];
  });
}

/// Area of the cells, facing the camera [square meters].
double area_of(const Region& region, const Grid& grid) {
  const double side = 1 / grid.camera().fx;
  double area = 0;
  for (const Eigen::Vector3d& p : region.points) area += std::pow(side * p.z(), 2);
  return area;
}

/// Half the width across the longer axis of what is seen, of an evenly spread set's deviation.
double half_width(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p.head<2>();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector2d d = p.head<2>() - mean;
    covariance += d * d.transpose();
  }
  covariance /= static_cast<double>(points.size());
  const double middle = covariance.trace() / 2;
  const double smaller =
      middle - std::hypot((covariance(0, 0) - covariance(1, 1)) / 2, covariance(0, 1));
  return std::sqrt(3 * std::max(0.0, smaller));
}

void place(const Region& region, const Grid& grid, const Pose& T_world_camera,
           const MoverDetectionOptions& options, MoverDetection& detection) {
  std::vector<Eigen::Vector3d> world;
  for (const Eigen::Vector3d& p : region.points) world.push_back(T_world_camera * p);
  const Spread spread = spread_of(world, options.trim);
  const Eigen::Vector3d ray = (spread.mean - T_world_camera.translation()).normalized();
  const double cell = (spread.mean - T_world_camera.translation()).norm() / grid.camera().fx;
  const double half_depth = std::min(half_width(region.points) + cell, options.max_half_depth);
  const Eigen::Vector3d behind = std::numbers::pi / 4 * half_depth * ray;
  detection.surface_mean = spread.mean;
  detection.centroid = spread.mean + behind;
  // A point is its cell's middle, and rims were left out: one cell on all sides is put back.
  detection.surface = {spread.box.min().array() - cell, spread.box.max().array() + cell};
  detection.box = detection.surface.merged(detection.surface.translated(2 * behind));
}

void name(const Region& region, const Grid& grid, const Frame& frame, MoverDetection& detection) {
  constexpr double kLeastShare = 0.3;
  const Cover cover = cover_of(region, grid);
  if (cover.instance == kNoInstance || cover.share < kLeastShare) return;
  const Instance& instance = frame.instances->instances[static_cast<std::size_t>(cover.instance)];
  detection.class_name = instance.class_name;
  detection.class_confidence = cover.share * instance.confidence;
}

void outline(const Region& region, const Grid& grid, MoverDetection& detection) {
  const cv::Rect cells = cv::boundingRect(region.cells);
  detection.image_box = {cells.x * kCellSide, cells.y * kCellSide, cells.width * kCellSide,
                         cells.height * kCellSide};
  detection.cut_off = cells.x == 0 || cells.y == 0 || cells.br().x >= grid.depth.cols ||
                      cells.br().y >= grid.depth.rows;
}

/// Whether a thing may go on beyond one of its cells: there the image ends, or something nearer
/// is, if need be a few cells without a depth farther (the shadow of a structured light).
bool goes_on_unseen(const Grid& grid, cv::Point cell, cv::Point step) {
  constexpr int kShadow = 3;  // cells
  const cv::Mat1f& depth = grid.cells.depth;
  const cv::Rect image({0, 0}, depth.size());
  const double here = depth(cell);
  for (int i = 1; i <= kShadow; ++i) {
    const cv::Point beyond = cell + i * step;
    if (!image.contains(beyond)) return true;
    const double there = depth(beyond);
    if (there > 0) return there < here - grid.jump.at(here);
  }
  return false;
}

/// Whether most of a region's last cells in a direction are not where the thing ends.
bool hidden_toward(const Region& region, const Grid& grid, cv::Point step) {
  std::map<int, cv::Point> last;  // by row or column
  for (const cv::Point& cell : region.cells) {
    const auto [found, first] = last.emplace(step.x != 0 ? cell.y : cell.x, cell);
    if (!first && (cell - found->second).dot(step) > 0) found->second = cell;
  }
  const auto hidden = std::count_if(last.begin(), last.end(), [&](const auto& entry) {
    return goes_on_unseen(grid, entry.second, step);
  });
  return 2 * static_cast<std::size_t>(hidden) > last.size();
}

void measure_spans(const Region& region, const Grid& grid, const Pose& T_world_camera,
                   const MoverDetectionOptions& options, MoverDetection& detection) {
  const Eigen::Vector3d extent = spread_of(region.points, options.trim).box.sizes();
  const std::array<cv::Point, 2> steps{cv::Point(1, 0), cv::Point(0, 1)};
  for (int axis = 0; axis < 2; ++axis) {
    SeenSpan& span = detection.spans[static_cast<std::size_t>(axis)];
    const cv::Point step = steps[static_cast<std::size_t>(axis)];
    span = {T_world_camera.rotation().col(axis), extent(axis), hidden_toward(region, grid, -step),
            hidden_toward(region, grid, step)};
    detection.cut_off |= span.low_hidden || span.high_hidden;
  }
}

/// Share of a region's cells with cells of it on all four sides: little for a strip of background
/// along something's outline. Beyond the image's border the region is taken to go on.
double core_of(const Region& region, const Grid& grid) {
  cv::Mat1b cells(grid.depth.size(), 0);
  for (const cv::Point& cell : region.cells) cells(cell) = 255;
  const cv::Mat cross = cv::getStructuringElement(cv::MORPH_CROSS, {3, 3});
  cv::morphologyEx(cells, cells, cv::MORPH_CLOSE, cross);  // holes in the depth are no outline
  cv::Mat1b inner;
  cv::erode(cells, inner, cv::Mat::ones(3, 3, CV_8UC1), {-1, -1}, 1, cv::BORDER_CONSTANT,
            cv::Scalar(255));
  return static_cast<double>(cv::countNonZero(inner)) / cv::countNonZero(cells);
}

/// Too small or too thin to be told from noise.
bool is_thing(const Region& region, const Grid& grid, const MoverDetectionOptions& options) {
  return static_cast<int>(region.cells.size()) >= options.min_cells &&
         area_of(region, grid) >= options.min_area && core_of(region, grid) >= options.min_core;
}

/// Regions of the image that move, and of which less than a tenth has a depth.
int count_without_depth(const Grid& grid, int min_cells) {
  cv::Mat1i labels;
  const int count = cv::connectedComponents(grid.moves, labels);
  std::vector<int> cells(static_cast<std::size_t>(count), 0);
  std::vector<int> with_depth = cells;
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const auto label = static_cast<std::size_t>(labels(y, x));
      ++cells[label];
      with_depth[label] += grid.cells.depth(y, x) > 0 ? 1 : 0;
    }
  }
  int result = 0;
  for (std::size_t i = 1; i < cells.size(); ++i)
    result += cells[i] >= min_cells && 10 * with_depth[i] < cells[i] ? 1 : 0;
  return result;
}

}  // namespace

MoverDetector::MoverDetector(const MoverDetectionOptions& options) : options_(options) {}

MoverDetections MoverDetector::detect(const Frame& frame, const Pose& T_world_camera) {
  const TraceScope scope("detect");
  const cv::Mat1b moves = moving_cells(frame);
  const bool judged = !frame.evidence.surface_log_odds.empty();
  const cv::Mat1b known =
      judged ? cv::Mat1b(moves.size(), 0) : background(frame, moves, T_world_camera);
  const Grid grid = make_grid(frame, moves, known, options_);

  MoverDetections result;
  result.without_depth = count_without_depth(grid, options_.min_cells);
  std::vector<Region> regions = connected_regions(grid);
  std::erase_if(regions, [&](const Region& region) {
    return cover_of(region, grid).instance == kNoInstance &&
           moving_share(region, grid) < options_.min_moving;
  });
  join_pieces(regions, grid, options_);
  keep_largest_pieces(regions, grid);
  for (const Region& region : regions) {
    MoverDetection detection;
    detection.moves = moving_share(region, grid) >= options_.min_moving;
    if (cover_of(region, grid).instance == kNoInstance)
      detection.moves &= came_here(region.points, T_world_camera);
    if (!is_thing(region, grid, options_)) {
      result.too_small += detection.moves ? 1 : 0;
      continue;
    }
    detection.cells = static_cast<int>(region.cells.size());
    place(region, grid, T_world_camera, options_, detection);
    name(region, grid, frame, detection);
    outline(region, grid, detection);
    measure_spans(region, grid, T_world_camera, options_, detection);
    result.movers.push_back(std::move(detection));
  }
  remember({frame.timestamp(), T_world_camera.inverse(), frame.cells, moves});
  return result;
}

/// 255 where a cell moves by its mask alone: it lies at the rim, or shows what stood there before.
cv::Mat1b MoverDetector::background(const Frame& frame, const cv::Mat1b& moves,
                                    const Pose& T_world_camera) const {
  const CellGrid& cells = *frame.cells;
  cv::Mat1b known = moves & ~without_rim(moves);
  for (int y = 0; y < moves.rows; ++y) {
    for (int x = 0; x < moves.cols; ++x) {
      const float z = cells.depth(y, x);
      if (moves(y, x) == 0 || known(y, x) != 0 || z == 0) continue;
      if (stood_there(T_world_camera * cells.camera.unproject(x, y, z))) known(y, x) = 255;
    }
  }
  return known;
}

void MoverDetector::remember(View view) {
  if (!views_.empty() && view.timestamp < views_.back().timestamp + options_.view_interval) return;
  views_.push_back(std::move(view));
  if (static_cast<int>(views_.size()) > options_.views) views_.pop_front();
}

/// A surface within the tolerance of the point, else what lies beyond it, or nothing that tells.
MoverDetector::Sight MoverDetector::sight(const View& view, const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d p = view.T_camera_world * p_world;
  const cv::Mat1f& depth = view.cells->depth;
  const auto pixel = DepthView{depth, view.cells->camera}.inner_pixel(p, kNearest);
  if (!pixel) return Sight::kNothing;
  const double tolerance = jump_of(view.cells->camera).at(p.z()) / 2;
  bool free = true;
  for (int y = pixel->y - 1; y <= pixel->y + 1; ++y) {
    for (int x = pixel->x - 1; x <= pixel->x + 1; ++x) {
      const Visibility visibility = visibility_of(p.z(), double{depth(y, x)}, tolerance);
      if (visibility == Visibility::kOnSurface)
        return view.moves(y, x) != 0 ? Sight::kMoving : Sight::kStanding;
      free = free && visibility == Visibility::kSeenThrough;
    }
  }
  return free ? Sight::kBeyond : Sight::kNothing;
}

/// Whether more views saw a standing surface there than saw it moving, or saw beyond it.
bool MoverDetector::stood_there(const Eigen::Vector3d& p_world) const {
  int votes = 0;
  for (const View& view : views_) {
    const Sight seen = sight(view, p_world);
    if (seen != Sight::kNothing) votes += seen == Sight::kStanding ? 1 : -1;
  }
  return votes > 0;
}

/// Whether more looks back at these points, in the camera's frame, went beyond them than met a
/// surface, moving or not.
bool MoverDetector::came_here(const std::vector<Eigen::Vector3d>& points,
                              const Pose& T_world_camera) const {
  constexpr std::size_t kEnough = 200;
  const std::size_t step = 1 + points.size() / kEnough;
  int votes = 0;
  for (const View& view : views_) {
    for (std::size_t i = 0; i < points.size(); i += step) {
      const Sight seen = sight(view, T_world_camera * points[i]);
      if (seen != Sight::kNothing) votes += seen == Sight::kBeyond ? 1 : -1;
    }
  }
  return votes > 0;
}

}  // namespace stillmap
