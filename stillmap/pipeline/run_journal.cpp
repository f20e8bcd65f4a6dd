// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/run_journal.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/map/map_records.hpp"
#include "stillmap/pipeline/journal_records.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Number of newest frames whose records may still change: those of keyframes get their own poses,
/// and those of a lost camera the poses of its relocalization. Mapping answers within fewer.
constexpr std::size_t kUnsettled = 300;
/// Number of newest frames whose samples of movers may still change: see MoverTracker.
constexpr std::size_t kUnsettledSamples = 16;
/// While this many records wait to be written, nothing more is asked for, so that a slow disk does
/// not hold up tracking. The queue is longer by the answers that are under way.
constexpr std::uint64_t kCompactAt = 3;  // times the size after the last compaction
constexpr std::size_t kMostWaiting = 4, kQueue = 2 * kMostWaiting;

/// Number of the section of the error of the depths among those of JournalKind::kCamera.
constexpr std::uint64_t kDepthErrorNumber = 3;

template <typename Tag>
JournalKey key_of(JournalKind kind, Id<Tag> id) {
  return {kind, std::uint64_t{id.slot} << 32 | id.generation};
}

/// @param written  Map::depth_error() of the keypoints that were written before
void put_map(const MapMaker& maker, DepthErrorPtr& written, JournalPart& part) {
  const Map& map = maker.map();
  const bool same_depths = std::exchange(written, map.depth_error()) == map.depth_error();
  if (map.depth_error() && !same_depths)
    part.put({JournalKind::kCamera, kDepthErrorNumber}, depth_error_bytes(*map.depth_error()));
  map.for_each_keyframe([&](const Keyframe& k) {
    ByteWriter state;
    put_keyframe_state(state, k, map.is_first(k.id));
    part.put(key_of(JournalKind::kKeyframe, k.id), state.bytes());
    if (same_depths && part.keep(key_of(JournalKind::kKeypoints, k.id))) return;
    ByteWriter keypoints;
    put_keypoints(keypoints, k);
    part.put(key_of(JournalKind::kKeypoints, k.id), keypoints.bytes());
  });
  map.for_each_landmark([&](const Landmark& l) {
    ByteWriter out;
    put_landmark(out, l);
    part.put(key_of(JournalKind::kLandmark, l.id), out.bytes());
  });
  for (const auto& [erased, replacement] : map.replacements()) {
    ByteWriter out;
    put_place(out, {replacement.keyframe, replacement.T_replacement_erased});
    part.put(key_of(JournalKind::kReplacement, erased), out.bytes());
  }
  for (std::size_t i = 0; i < maker.events().size(); ++i) {
    ByteWriter out;
    put_event(out, maker.events()[i]);
    part.put({JournalKind::kEvent, i}, out.bytes());
  }
  for (const JournalKind kind :
       {JournalKind::kKeyframe, JournalKind::kKeypoints, JournalKind::kLandmark})
    part.remove_others(kind);
}

/// Views never change once they are final. Those for which there is no room in the record come with
/// the next one.
/// @param unfinished  views that were not final when they were written
void put_views(const DenseStream& dense, std::set<std::uint64_t>& unfinished, JournalPart& part) {
  for (const auto& [id, place] : dense.places()) {
    ByteWriter out;
    put_place(out, place);
    part.put({JournalKind::kViewPlace, id}, out.bytes());
  }
  for (const auto& [id, view] : dense.views()) {
    const bool is_final = dense.open_view() != id;
    const bool outdated = is_final && !part.full() && unfinished.erase(id) > 0;
    if (!outdated && (part.keep({JournalKind::kView, id}) || part.full())) continue;
    ByteWriter out;
    put_view(out, *view);
    part.put({JournalKind::kView, id}, out.bytes());
    if (!is_final) unfinished.insert(id);
  }
  part.remove_others(JournalKind::kView);
}

/// @param since  index of the first frame whose samples may be new
/// @returns that of the next call
std::size_t put_movers(const MoverTracker& tracker, std::size_t since, JournalPart& part) {
  for (const MoverTrack& track : tracker.tracks_since(since)) {
    const auto id = static_cast<std::uint64_t>(track.id);
    ByteWriter identity;
    put_identity(identity, track);
    part.put({JournalKind::kMover, id}, identity.bytes());
    for (const MoverSample& sample : track.samples) {
      ByteWriter out;
      put_sample(out, {sample, tracker.poses().at(sample.frame_index)});
      part.put({JournalKind::kMoverSample, id << 40 | sample.frame_index}, out.bytes());
    }
  }
  const std::size_t newest = tracker.poses().empty() ? 0 : tracker.poses().rbegin()->first;
  return newest - std::min(newest, kUnsettledSamples);
}

/// The writer of the file, and the size at which its records are replaced by one without the
/// entries that were changed or removed since.
struct Journal {
  JournalWriter writer;
  std::uint64_t compact_at;  // [bytes]

  void append(const std::string& record, const std::filesystem::path& file) {
    writer.append(record);
    if (writer.size() < compact_at) return;
    const JournalContent content(file);
    writer.replace_all([&](JournalWriter& next) { content.write_to(next); });
    compact_at = std::max(compact_at, kCompactAt * writer.size());
  }
};

/// Returns the work of the thread that writes the file.
auto writing_to(const std::filesystem::path& file, std::uint64_t compact_at) {
  auto journal = std::make_shared<std::optional<Journal>>(Journal{JournalWriter(file), compact_at});
  return [journal, file](const std::string& record, const auto&) {
    if (!*journal) return;
    try {
      (*journal)->append(record, file);
    } catch (const Error& e) {
      journal->reset();
      warn(std::string("the journal of the run ends here: ") + e.what(),
           "the run goes on, but a process that is killed loses what comes now");
    }
  };
}

}  // namespace

RunJournal::RunJournal(SlamSystem& slam, const std::filesystem::path& file,
                       const JournalHeading& heading, std::chrono::milliseconds period,
                       std::uint64_t compact_at)
    : slam_(slam),
      period_(period),
      writer_(kQueue, WhenFull::kBlock, writing_to(file, compact_at), "journal",
              ThreadPriority::kBackground) {
  parts_[0].ask = [this](JournalPart& part) {
    return slam_.ask_map(
        [this, &part](const MapMaker& maker) { put_map(maker, depth_error_, part); });
  };
  parts_[1].ask = [this](JournalPart& part) {
    return slam_.ask_views(
        [this, &part](const DenseStream& dense) { put_views(dense, unfinished_, part); });
  };
  parts_[2].ask = [this](JournalPart& part) {
    return slam_.ask_mover_tracks([this, &part](const MoverTracker& tracker) {
      samples_from_ = put_movers(tracker, samples_from_, part);
    });
  };
  parts_[3].ask = [this](JournalPart& part) {
    return std::async(std::launch::deferred, [this, &part] { put_frames(part); });
  };
  JournalPart part;
  ByteWriter run;
  for (const std::string& text :
       {heading.writer, heading.sequence, heading.machine, heading.options})
    run.put_text(text);
  part.put({JournalKind::kRun, 0}, run.bytes());
  std::uint64_t number = 0;
  for (const Section& section : map_sections({slam.camera(), slam.pyramid(), {}, {}, {}, {}}))
    part.put({JournalKind::kCamera, number++}, section.bytes);
  writer_.push(part.take());
}

/// Pending questions use this object; add_newest() leaves none that is deferred.
RunJournal::~RunJournal() {
  for (const Part& part : parts_) {
    if (part.answer.valid()) part.answer.wait();
  }
}

void RunJournal::add_newest() {
  for (Part& part : parts_) update(part);
}

/// Asks if it is time, and writes the answer if it has come.
void RunJournal::update(Part& part) {
  if (!part.answer.valid()) {
    if (Clock::now() < part.next || writer_.waiting() >= kMostWaiting) return;
    part.next = Clock::now() + period_;
    part.answer = part.ask(part.entries);
  }
  const auto state = part.answer.wait_for(std::chrono::seconds(0));
  if (state != std::future_status::timeout) write_answer(part);
}

void RunJournal::flush() {
  slam_.wait_for_views();
  for (Part& part : parts_) {
    if (part.answer.valid()) write_answer(part);
    do {
      part.answer = part.ask(part.entries);
    } while (write_answer(part) >= kFullRecord);
  }
  writer_.drain();
}

/// @returns the size of the record [bytes]
std::size_t RunJournal::write_answer(Part& part) {
  part.answer.get();
  std::string record = part.entries.take();
  const std::size_t size = record.size();
  if (size > 0) writer_.push(std::move(record));
  return size;
}

void RunJournal::put_frames(JournalPart& part) {
  const std::vector<FrameRecord>& records = slam_.records();
  for (std::size_t i = settled_; i < records.size(); ++i) {
    ByteWriter out;
    put_frame(out, records[i]);
    part.put({JournalKind::kFrame, records[i].index}, out.bytes());
  }
  settled_ = records.size() - std::min(records.size(), kUnsettled);
}

}  // namespace stillmap
