// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/frame_watch.hpp"

#include "stillmap/warn/zone_view.hpp"

#include <utility>

#include <opencv2/core.hpp>

namespace stillmap {
namespace {

/// Returns the share of the pixels with a depth, from every fourth row [0..1].
double depth_share(const cv::Mat& depth) {
  std::size_t known = 0, all = 0;
  for (int y = 0; y < depth.rows; y += 4) {
    known += static_cast<std::size_t>(cv::countNonZero(depth.row(y)));
    all += static_cast<std::size_t>(depth.cols);
  }
  return all == 0 ? 0 : static_cast<double>(known) / static_cast<double>(all);
}

}  // namespace

FrameWatch::FrameWatch(std::vector<Zone> zones, bool has_network)
    : zones_(std::move(zones)), has_network_(has_network) {}

/// Returns the age of the network's result [s]. Before the first it is the time since the first
/// frame.
double FrameWatch::mask_age(const FrameRecord& record) {
  if (previous_ > 0) frame_time_ = record.timestamp - previous_;
  previous_ = record.timestamp;
  if (!has_network_) return 0;
  return record.mask_age < 0 ? record.timestamp - *first_ : record.mask_age * frame_time_;
}

WatchedFrame FrameWatch::newest(SlamSystem& slam) {
  const FrameRecord& record = slam.newest_record();
  const TrackedFrame& newest = *slam.newest();
  const cv::Mat1f& depth = newest.frame->image->depth;
  const std::vector<Mover> movers = slam.movers();
  if (!first_) first_ = record.timestamp;
  WatchedFrame frame{.index = record.index,
                     .timestamp = record.timestamp,
                     .T_world_camera = newest.T_world_filtered(),
                     .depth_share = depth_share(depth),
                     .mask_age = mask_age(record),
                     .movers_age = record.timestamp - slam.movers_time().value_or(*first_),
                     .zones_seen = {},
                     .movers = {}};
  if (frame.T_world_camera) {
    for (const Zone& zone : zones_)
      frame.zones_seen.push_back(seen_share(zone, slam.camera(), *frame.T_world_camera, depth));
  }
  for (const Mover& mover : movers) {
    frame.movers.push_back({.id = mover.id,
                            .class_name = mover.class_name,
                            .confidence = mover.class_confidence,
                            .observed = mover.now.observed,
                            .centroid = mover.now.centroid,
                            .velocity = mover.now.velocity,
                            .box = mover.now.box});
  }
  return frame;
}

}  // namespace stillmap
