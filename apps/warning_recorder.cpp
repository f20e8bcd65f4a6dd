// SPDX-License-Identifier: Apache-2.0
#include "warning_recorder.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/view/ground.hpp"
#include "stillmap/warn/event_delivery.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns the finding that the zones stand tilted, since their upward direction was not given and
/// the floor of the run shows another one; none if there is none.
std::optional<Finding> tilted_zones(const WarningRules& rules, const SlamResult& result) {
  constexpr double kTolerated = 10;  // [degrees]
  if (rules.up_is_given) return std::nullopt;
  const Ground ground = displayed_ground(result.trajectory, result.dense.cloud);
  const double angle =
      std::acos(std::clamp(rules.up.dot(ground.up), -1.0, 1.0)) * 180 / std::numbers::pi;
  if (ground.source != UpSource::kFloor || angle < kTolerated) return std::nullopt;
  return make_finding(
      "zones-tilted",
      fmt::format("the rules have no upward direction, so the camera was taken to start level, but "
                  "the floor is tilted by {:.0f} degrees",
                  angle),
      fmt::format("add the line 'up: [{:.3f}, {:.3f}, {:.3f}]' to the file of --zones",
                  ground.up.x(), ground.up.y(), ground.up.z()),
      {{"tilt_deg", angle}});
}

}  // namespace

WarningRecorder::WarningRecorder(const WarningRules& rules, ResultFolder& folder,
                                 WarningOutputs outputs, bool has_network)
    : monitor_(rules), watched_(rules.zones, has_network), outputs_(std::move(outputs)) {
  folder.write_text(kRunRules, rules_yaml(rules));
  folder.write(kRunWarnings, [&](const std::filesystem::path& file) {
    write_file(file, "");
    file_.open(file, std::ios::app);
  });
  if (outputs_.show) outputs_.show(zones_message(rules));
}

WarningRecorder::~WarningRecorder() { watch_.request_stop(); }

void WarningRecorder::send_events() {
  for (const EventAddress& address : monitor_.rules().receivers)
    receivers_.push_back({address, std::make_unique<EventSender>(delivery_to(address, run_))});
}

void WarningRecorder::watch_for_silence() {
  watch_ = std::jthread([this](const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      stopped_.wait_for(lock, stop, kSilence / 10, [] { return false; });
      if (newest_ && std::chrono::steady_clock::now() > *newest_ + kSilence)
        record(monitor_.announce("no image was processed for 1 s"));
    }
  });
}

void WarningRecorder::on_frame(SlamSystem& slam) {
  const WatchedFrame frame = watched_.newest(slam);
  const std::unique_lock lock(mutex_);
  newest_ = std::chrono::steady_clock::now();
  record(monitor_.update(frame));
}

void WarningRecorder::add(const WatchedFrame& frame) {
  const std::unique_lock lock(mutex_);
  record(monitor_.update(frame));
}

void WarningRecorder::on_last_frame(RunRecord& record) {
  finish();
  record.warnings = told_;
  append(findings_, record.findings);
}

void WarningRecorder::on_results(RunRecord& record) {
  if (auto finding = tilted_zones(monitor_.rules(), record.result))
    record.findings.push_back(*std::move(finding));
}

void WarningRecorder::finish() {
  watch_ = {};
  const std::unique_lock lock(mutex_);
  if (std::exchange(finished_, true)) return;
  if (newest_) record(monitor_.announce("the run has ended"));
  if (outputs_.show) outputs_.show(events_message(warnings_of(events_)));
  for (const Receiver& receiver : receivers_) receiver.sender->begin_finish();
  for (const Receiver& receiver : receivers_) {
    const SentEvents events = receiver.sender->finish();
    print_out("{}: {} sent", receiver.address.text(), counted(events.sent, "event"));
    if (events.refused > 0) print_out(", {} refused", events.refused);
    if (events.dropped > 0)
      print_out(", {} dropped: {}", events.dropped,
                events.reason.empty() ? "it was away or too slow" : events.reason);
    print_out("\n");
    if (events.sent == 0 && events.refused + events.dropped > 0)
      findings_.push_back(make_finding(
          "events-lost", fmt::format("{} got none of {}", receiver.address.text(),
                                     counted(events.refused + events.dropped, "event"))));
  }
}

namespace {

/// Returns the time of day [s since 1970, UTC].
double seconds_since_epoch() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

/// Called with the mutex held.
void WarningRecorder::record(const std::vector<WarningEvent>& events) {
  for (const WarningEvent& event : events) {
    if (event.begins) ++warnings_;
    nlohmann::json json = warning_json(event);
    const std::string line = json_text(json);
    if (file_.is_open()) file_ << line << '\n' << std::flush;
    events_.push_back(event);
    told_.push_back({event.timestamp, warning_text(event)});
    json["run"] = run_;
    json["sent"] = seconds_since_epoch();
    for (const Receiver& receiver : receivers_) receiver.sender->send(json_text(json));
    if (outputs_.lines != nullptr) {
      write_text(outputs_.lines, line + "\n");
      std::fflush(outputs_.lines);
    } else {
      print_out("{:.3f} s, frame {}: {}\n", event.timestamp, event.frame, warning_text(event));
    }
  }
  if (!events.empty()) output_is_complete();  // shows them now
  if (outputs_.show && !events.empty())
    outputs_.show(warnings_message(monitor_.active(), warnings_));
}

}  // namespace stillmap
