// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/live_changes.hpp"

#include "stillmap/base/json_text.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr double kInterval = 10;  // time between two comparisons [s]

bool intersect(const std::optional<ChangedSurface>& a, const std::optional<ChangedSurface>& b) {
  return a && b && a->box.intersects(b->box);
}

/// Returns whether two changes of two comparisons are of the same object.
bool is_same(const MapChange& a, const MapChange& b) {
  return intersect(a.before, b.before) || intersect(a.after, b.after);
}

/// Returns whether a change says no more than an earlier one of the same object: that it moved is
/// more than that it went or appeared.
bool says_no_more(const MapChange& change, const MapChange& earlier) {
  const bool moved = change.before && change.after;
  return !moved || (earlier.before && earlier.after);
}

}  // namespace

LiveChanges::LiveChanges(SlamSystem& slam, const SlamParameters& options, ResultFolder& folder,
                         std::function<void(const std::string&)> show)
    : slam_(slam),
      realtime_(options.schedule.realtime),
      options_(options.dense),
      lines_(folder, kLiveChanges, ""),
      show_(std::move(show)) {}

void LiveChanges::on_frame(SlamSystem& slam) {
  if (realtime_ && is_ready()) tell();
  const double now = slam.newest()->frame->timestamp();
  if (!next_) next_ = now + kInterval;
  if (now < *next_ || (realtime_ && begun_)) return;
  next_ = now + kInterval;
  tell();
  begin();
}

void LiveChanges::on_last_frame(RunRecord& /*record*/) {
  tell();
  if (!slam_.newest()) return;
  begin();
  tell(true);
}

/// Begins a comparison of the views so far: in lockstep of those at this frame; in realtime of
/// those at the time when the map's threads have answered, so that the camera does not wait for
/// them.
void LiveChanges::begin() {
  std::optional<SavedMap> at_frame;
  if (!realtime_) {
    slam_.wait_for_map();
    at_frame = slam_.saved_map("");
  }
  begun_ = {slam_.newest()->frame->timestamp(),
            std::async(std::launch::async, [this, saved = std::move(at_frame)] {
              return newest_changes(saved ? *saved : slam_.saved_map(""), options_);
            })};
}

bool LiveChanges::is_ready() const {
  return begun_ && begun_->changes.wait_for(std::chrono::seconds(0)) != std::future_status::timeout;
}

/// Waits for the comparison that was begun last, and tells its changes as far as they are new and
/// confirmed.
/// @param is_last  whether it is the comparison at the end, whose changes need no confirmation
void LiveChanges::tell(bool is_last) {
  if (!begun_) return;
  std::vector<MapChange> found = begun_->changes.get();
  for (const MapChange& change : found) {
    const auto is_told = [&](const MapChange& told) {
      return is_same(change, told) && says_no_more(change, told);
    };
    const auto confirms = [&](const MapChange& before) { return is_same(change, before); };
    if (std::ranges::any_of(told_, is_told)) continue;
    if (!is_last && std::ranges::none_of(before_, confirms)) continue;
    nlohmann::json line = change_json(change);
    line["timestamp"] = begun_->timestamp;
    lines_.add(json_text(line) + "\n");
    if (show_) show_(fmt::format("{:.3f} s: {}", begun_->timestamp, change_text(change)));
    told_.push_back(change);
  }
  before_ = std::move(found);
  begun_.reset();
}

}  // namespace stillmap
