// SPDX-License-Identifier: Apache-2.0
#include "warning_recorder.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"

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

WarningRecorder::WarningRecorder(const WarningRules& rules, ResultFolder& folder,
                                 std::function<void(const nlohmann::json&)> show)
    : monitor_(rules), show_(std::move(show)) {
  folder.write(kRunWarnings, [&](const std::filesystem::path& file) {
    write_file(file, "");
    file_.open(file, std::ios::app);
  });
  if (show_) show_(zones_message(rules));
}

void WarningRecorder::add_newest(SlamSystem& slam) {
  const FrameRecord& record = slam.newest_record();
  const TrackedFrame& newest = *slam.newest();
  if (previous_ > 0) frame_time_ = record.timestamp - previous_;
  previous_ = record.timestamp;
  WatchedFrame frame{.index = record.index,
                     .timestamp = record.timestamp,
                     .T_world_camera = newest.T_world_filtered(),
                     .depth_share = depth_share(newest.frame->image->depth),
                     .mask_age = std::max(0, record.mask_age) * frame_time_,
                     .movers = {}};
  for (const Mover& mover : slam.movers()) {
    frame.movers.push_back({.id = mover.id,
                            .class_name = mover.class_name,
                            .confidence = mover.class_confidence,
                            .observed = mover.now.observed,
                            .centroid = mover.now.centroid,
                            .velocity = mover.now.velocity,
                            .box = mover.now.box});
  }
  add(frame);
}

void WarningRecorder::add(const WatchedFrame& frame) {
  const auto events = monitor_.update(frame);
  for (const WarningEvent& event : events) {
    if (event.begins) ++warnings_;
    if (file_.is_open()) file_ << json_text(warning_json(event)) << '\n' << std::flush;
    print_out("{:.3f} s, frame {}: {}\n", event.timestamp, event.frame, warning_text(event));
  }
  if (!events.empty()) output_is_complete();  // shows them now
  if (show_ && !events.empty()) show_(warnings_message(monitor_.active(), warnings_));
}

}  // namespace stillmap
