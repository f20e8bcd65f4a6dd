// SPDX-License-Identifier: Apache-2.0
// The record of a run's journal, not compressed.
#include "stillmap/base/journal_file.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/map/map_records.hpp"
#include "stillmap/pipeline/journal_entries.hpp"
#include "stillmap/pipeline/journal_records.hpp"
#include "stillmap/pipeline/recovered_run.hpp"

#include <array>
#include <cstdlib>
#include <utility>

#include "fuzz/fuzz_target.hpp"
#include "fuzz/small_map.hpp"

namespace {

using namespace stillmap;

/// A record under construction.
class Record {
 public:
  template <typename Put>
  void add(JournalKind kind, std::uint64_t id, Put&& put) {
    ByteWriter out;
    put(out);
    part_.put({kind, id}, out.bytes());
  }
  std::string bytes() { return part_.take(); }

 private:
  JournalPart part_;
};

std::uint64_t number_of(auto id) { return std::uint64_t{id.slot} << 32 | id.generation; }

void add_map(const Map& map, Record& record) {
  MapContent empty = map.content();
  empty.keyframes.clear(), empty.landmarks.clear(), empty.first.clear();
  std::uint64_t number = 0;
  for (const Section& section : map_sections(empty)) {
    record.add(JournalKind::kCamera, number++,
               [&](ByteWriter& out) { out.put_list(std::span<const char>(section.bytes)); });
  }
  map.for_each_keyframe([&](const Keyframe& k) {
    record.add(JournalKind::kKeyframe, number_of(k.id),
               [&](ByteWriter& out) { put_keyframe_state(out, k, map.is_first(k.id)); });
    record.add(JournalKind::kKeypoints, number_of(k.id),
               [&](ByteWriter& out) { put_keypoints(out, k); });
  });
  map.for_each_landmark([&](const Landmark& l) {
    record.add(JournalKind::kLandmark, number_of(l.id),
               [&](ByteWriter& out) { put_landmark(out, l); });
  });
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  Record record;
  record.add(JournalKind::kRun, 0, [](ByteWriter& out) {
    for (const char* text : {"fuzz", "sequence", "machine", "options"}) out.put_text(text);
  });
  const Map map = small_map();
  add_map(map, record);
  const KeyframeId first = map.content().keyframes.front().id;
  FrameRecord frame;
  frame.state = TrackState::kTracking;
  frame.reference = first;
  record.add(JournalKind::kFrame, 0, [&](ByteWriter& out) { put_frame(out, frame); });
  record.add(JournalKind::kEvent, 0, [](ByteWriter& out) { put_event(out, {}); });
  record.add(JournalKind::kView, 7, [](ByteWriter& out) { put_view(out, small_view().view); });
  record.add(JournalKind::kViewPlace, 7, [&](ByteWriter& out) { put_place(out, {first, {}}); });
  record.add(JournalKind::kReplacement, 99, [&](ByteWriter& out) { put_place(out, {first, {}}); });
  record.add(JournalKind::kMover, 1, [](ByteWriter& out) { put_identity(out, MoverTrack()); });
  PlacedSample sample;
  sample.sample.observed = true;
  record.add(JournalKind::kMoverSample, std::uint64_t{1} << 40,
             [&](ByteWriter& out) { put_sample(out, sample); });
  return {record.bytes()};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto file = fuzz::file_with("", "run.journal");
  JournalWriter(file).append(fuzz::text_of(data, size));
  fuzz::parse([&] {
    // What was recovered can be saved as a map, and read again.
    const std::string written = saved_map_bytes(recovered_run(file).map);
    if (saved_map_bytes(saved_map_from_bytes(written, "copy")) != written) std::abort();
  });
  return 0;
}
