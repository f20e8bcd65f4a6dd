// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/gallery.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/report/frame_image.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::size_t kImages = 6;
constexpr std::size_t kUsualLength =
    600;  // assumed length of a sequence of unknown length [frames]

}  // namespace

Gallery::Gallery(std::optional<std::size_t> total_frames)
    : every_(std::max<std::size_t>(1, total_frames.value_or(kUsualLength) / kImages)) {}

void Gallery::on_frame(SlamSystem& slam) {
  const TrackedFrame& tracked = *slam.newest();
  const std::size_t index = tracked.frame->index();
  if (index % every_ != every_ / 2 || images_.size() >= kImages) return;
  std::string caption = fmt::format("frame {} at {:.2f} s: {} inlier landmarks", index,
                                    tracked.frame->timestamp(), tracked.inliers);
  if (const auto& masks = tracked.frame->instances) {
    caption += fmt::format(", {}, masks {} old", counted(masks->instances.size(), "object"),
                           counted(masks->age(), "frame"));
  }
  images_.push_back({draw_frame(tracked), caption});
}

}  // namespace stillmap
