// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/recovered_run.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/journal_file.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/map/map_records.hpp"
#include "stillmap/motion/mover_joining.hpp"
#include "stillmap/pipeline/journal_records.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

KeyframeId keyframe_of(std::uint64_t id) {
  return {static_cast<std::uint32_t>(id >> 32), static_cast<std::uint32_t>(id)};
}

/// Reader of the entries of a journal.
class Recovery {
 public:
  explicit Recovery(const std::filesystem::path& file) : content_(file), where_(file.string()) {
    content_.for_each([&](JournalKey key, std::string_view bytes) {
      if (key.kind != JournalKind::kView) entries_.emplace(key, bytes);
    });
  }

  RecoveredRun run(const MemoryLimit& memory) {
    RecoveredRun run;
    run.heading = heading();
    run.map.writer = run.heading.writer;
    run.map.damage = damage();
    run.map.map = map();
    run.map.views = views(run.map.map.camera, memory);
    const Map map(run.map.map);
    const FrameLog log(frames());
    run.frames = log.records_in(map);
    for_each(JournalKind::kEvent,
             [&](std::uint64_t, ByteReader in) { run.events.push_back(get_event(in)); });
    run.movers = movers(log.poses(map));
    return run;
  }

 private:
  std::string damage() const {
    if (content_.lost() == 0) return "";
    return fmt::format(
        "a record of the journal {} is damaged, and its last {} bytes are not read: the later part "
        "of the run is missing; map the recording again",
        where_, content_.lost());
  }

  template <typename Read>
  void for_each(JournalKind kind, Read&& read) const {
    const auto end = entries_.end();
    for (auto entry = entries_.lower_bound({kind, 0}); entry != end && entry->first.kind == kind;
         ++entry)
      read(entry->first.id, reader(entry->second));
  }

  ByteReader reader(std::string_view bytes) const {
    return {bytes, where_, "the journal is damaged; map the recording again"};
  }

  JournalHeading heading() const {
    const auto entry = entries_.find({JournalKind::kRun, 0});
    if (entry == entries_.end()) {
      throw Error("ends before its first record", where_,
                  "the run was ended at once; map the recording again");
    }
    ByteReader in = reader(entry->second);
    JournalHeading heading;
    for (std::string* text :
         {&heading.writer, &heading.sequence, &heading.machine, &heading.options})
      *text = in.get_text();
    return heading;
  }

  /// Returns the map without keyframes and landmarks.
  MapContent empty_map() const {
    constexpr std::array<std::array<char, 4>, 4> kNames{
        {{'C', 'A', 'M', 'R'}, {'K', 'E', 'Y', 'F'}, {'L', 'A', 'N', 'D'}, kDepthErrorSection}};
    std::vector<Section> sections;
    for_each(JournalKind::kCamera, [&](std::uint64_t number, const ByteReader& in) {
      if (number >= kNames.size()) in.fail("a section is unknown");
      sections.push_back({kNames[number], entries_.at({JournalKind::kCamera, number})});
    });
    return map_from_sections(sections, where_);
  }

  MapContent map() {
    MapContent map = empty_map();
    for_each(JournalKind::kKeyframe, [&](std::uint64_t id, ByteReader in) {
      Keyframe k;
      k.id = {static_cast<std::uint32_t>(map.keyframes.size()), 0};
      if (get_keyframe_state(in, k)) map.first.emplace(k.component, k.id);
      const auto keypoints = entries_.find({JournalKind::kKeypoints, id});
      if (keypoints == entries_.end()) in.fail("a keyframe has no keypoints");
      ByteReader points = reader(keypoints->second);
      get_keypoints(points, map.camera, map.pyramid, k);
      keyframes_[keyframe_of(id)] = k.id;
      map.keyframes.push_back(std::move(k));
    });
    // The oldest remaining keyframe, if the first one was erased.
    for (const Keyframe& k : map.keyframes) map.first.emplace(k.component, k.id);
    for_each(JournalKind::kLandmark, [&](std::uint64_t, ByteReader in) { add_landmark(in, map); });
    for_each(JournalKind::kReplacement, [&](std::uint64_t id, ByteReader in) {
      replacements_[keyframe_of(id)] = get_place(in);
    });
    // Numbers the components without gaps, and checks the invariants of a map.
    return map_from_sections(map_sections(Map(std::move(map)).content()), where_);
  }

  void add_landmark(ByteReader& in, MapContent& map) const {
    Landmark landmark = get_landmark(in);
    landmark.id = {static_cast<std::uint32_t>(map.landmarks.size()), 0};
    for (Observation& o : landmark.observations) {
      const auto found = keyframes_.find(o.keyframe);
      if (found == keyframes_.end()) in.fail("an observation refers to a missing keyframe");
      o.keyframe = found->second;
      auto& landmarks = map.keyframes[o.keyframe.slot].landmarks;
      if (o.keypoint >= landmarks.size()) in.fail("an observation refers to a missing keypoint");
      landmarks[o.keypoint] = landmark.id;
    }
    map.landmarks.push_back(std::move(landmark));
  }

  /// Returns the place relative to a keyframe of the map; none if the keyframe was dropped or is
  /// newer than the map.
  std::optional<RelativePlace> in_map(RelativePlace place) const {
    for (std::size_t step = 0; step <= replacements_.size(); ++step) {
      const auto found = keyframes_.find(place.keyframe);
      if (found != keyframes_.end()) return RelativePlace{found->second, place.T_keyframe_camera};
      const auto other = replacements_.find(place.keyframe);
      if (other == replacements_.end()) return std::nullopt;
      place = {other->second.keyframe, other->second.T_keyframe_camera * place.T_keyframe_camera};
    }
    return std::nullopt;
  }

  std::vector<AnchoredView> views(const Camera& camera, const MemoryLimit& memory) const {
    std::map<std::uint64_t, AnchoredView> by_id;
    ViewReader views(memory);
    content_.for_each([&](JournalKey key, std::string_view bytes) {
      if (key.kind != JournalKind::kView) return;
      const auto entry = entries_.find({JournalKind::kViewPlace, key.id});
      if (entry == entries_.end()) return;
      ByteReader place_bytes = reader(entry->second);
      const auto place = in_map(get_place(place_bytes));
      if (!place) return;
      ByteReader in = reader(bytes);
      by_id[key.id] = {place->keyframe, place->T_keyframe_camera, views.read(in, camera)};
    });
    std::vector<AnchoredView> in_order;
    for (auto& [id, view] : by_id) {
      if (id < DenseStream::view_of(0)) view.view.visit = 0;  // of a loaded map
      in_order.push_back(std::move(view));
    }
    number_present_visit(in_order);
    return in_order;
  }

  std::vector<FrameRecord> frames() const {
    std::vector<FrameRecord> frames;
    for_each(JournalKind::kFrame, [&](std::uint64_t, ByteReader in) {
      FrameRecord frame = get_frame(in);
      const auto place = in_map({frame.reference, frame.T_reference_camera});
      frame.reference = place ? place->keyframe : KeyframeId();
      if (place) frame.T_reference_camera = place->T_keyframe_camera;
      frames.push_back(std::move(frame));
    });
    return frames;
  }

  std::vector<MoverTrack> movers(const std::map<std::size_t, Pose>& poses) const {
    std::map<std::uint64_t, MoverTrack> tracks;
    for_each(JournalKind::kMover,
             [&](std::uint64_t id, ByteReader in) { tracks[id] = get_identity(in); });
    for_each(JournalKind::kMoverSample, [&](std::uint64_t id, ByteReader in) {
      const PlacedSample placed = get_sample(in);
      const auto pose = poses.find(placed.sample.frame_index);
      const auto track = tracks.find(id >> 40);
      if (pose == poses.end() || track == tracks.end()) return;
      track->second.samples.push_back(
          moved(placed.sample, pose->second * placed.T_world_camera.inverse()));
    });
    std::vector<MoverTrack> all;
    for (auto& [id, track] : tracks) {
      while (!track.samples.empty() && !track.samples.back().observed) track.samples.pop_back();
      if (track.samples.empty()) continue;
      track.first_seen = track.samples.front().timestamp;
      track.last_seen = track.samples.back().timestamp;
      all.push_back(std::move(track));
    }
    return joined_movers(std::move(all));
  }

  const JournalContent content_;
  std::map<JournalKey, std::string> entries_;  // all but the views
  const std::string where_;
  std::map<KeyframeId, KeyframeId> keyframes_;        // positions in the map, by id in the journal
  std::map<KeyframeId, RelativePlace> replacements_;  // of erased keyframes, by id in the journal
};

}  // namespace

RecoveredRun recovered_run(const std::filesystem::path& file, const MemoryLimit& memory) {
  return Recovery(file).run(memory);
}

}  // namespace stillmap
