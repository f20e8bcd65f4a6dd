// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/mover_files.hpp"

#include "stillmap/base/json_text.hpp"
#include "stillmap/evaluate/mover_error.hpp"
#include "stillmap/evaluate/statistics.hpp"

#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

struct Entry {
  const MoverTrack* track;
  const MoverSample* sample;
};

/// Returns the samples by frame; within a frame in order of the ids, as the tracks are.
std::map<std::size_t, std::vector<Entry>> by_frame(const std::vector<MoverTrack>& tracks) {
  std::map<std::size_t, std::vector<Entry>> frames;
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& sample : track.samples)
      frames[sample.frame_index].push_back({&track, &sample});
  }
  return frames;
}

std::string triple(const Eigen::Vector3d& v) {
  return fmt::format("{:.4f},{:.4f},{:.4f}", v.x(), v.y(), v.z());
}

/// Rounds to 0.1 mm, since further digits contain no information.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

nlohmann::json json_of(const Eigen::Vector3d& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

nlohmann::json json_of(const Eigen::AlignedBox3d& box) {
  return {json_of(box.min()), json_of(box.max())};
}

nlohmann::json json_of(const Entry& entry) {
  const MoverTrack& track = *entry.track;
  const MoverSample& sample = *entry.sample;
  return {{"id", track.id},
          {"class", track.class_name},
          {"class_confidence", rounded(track.class_confidence)},
          {"state", state_of(sample)},
          {"centroid", json_of(Eigen::Vector3d(sample.centroid))},
          {"velocity", json_of(Eigen::Vector3d(sample.velocity))},
          {"box", json_of(sample.box)},
          {"surface", json_of(sample.surface)},
          {"first_seen", track.first_seen},
          {"last_seen", track.last_seen}};
}

}  // namespace

const char* state_of(const MoverSample& sample) {
  if (!sample.observed) return "predicted";
  return sample.moves ? "moving" : "standing";
}

std::string movers_csv(const std::vector<MoverTrack>& tracks) {
  std::string text =
      "# Moving objects, one line per mover and frame. World frame of trajectory.txt; meters, "
      "seconds, meters per second.\n"
      "# state: moving; standing (observed, not known to move); predicted (not observed).\n"
      "# x y z: centroid of an object as deep as wide behind the observed surface. min, max: box "
      "of this object along the world's axes.\n"
      "timestamp,id,class,state,x,y,z,vx,vy,vz,min_x,min_y,min_z,max_x,max_y,max_z,first_seen,last_"
      "seen\n";
  for (const auto& [frame, entries] : by_frame(tracks)) {
    for (const auto& [track, sample] : entries) {
      text += fmt::format("{:.6f},{},{},{},{},{},{},{},{:.6f},{:.6f}\n", sample->timestamp,
                          track->id, track->class_name, state_of(*sample), triple(sample->centroid),
                          triple(sample->velocity), triple(sample->box.min()),
                          triple(sample->box.max()), track->first_seen, track->last_seen);
    }
  }
  return text;
}

std::string movers_jsonl(const std::vector<MoverTrack>& tracks) {
  std::string text;
  for (const auto& [frame, entries] : by_frame(tracks)) {
    nlohmann::json line{{"timestamp", entries.front().sample->timestamp}, {"movers", {}}};
    for (const Entry& entry : entries) line["movers"].push_back(json_of(entry));
    text += json_text(line) + "\n";
  }
  return text;
}

std::vector<MoverTrack> read_mover_tracks(const std::filesystem::path& file) {
  std::map<int, MoverTrack> tracks;
  for (const MoverPosition& position : read_movers(file)) {
    MoverTrack& track = tracks[position.id];
    if (track.samples.empty()) track.first_seen = position.timestamp;
    track.id = position.id;
    track.class_name = position.class_name;
    if (position.observed) track.last_seen = position.timestamp;
    MoverSample sample;
    sample.timestamp = position.timestamp;
    sample.observed = position.observed;
    sample.centroid = position.centroid;
    sample.velocity = position.velocity;
    sample.box = position.box;
    track.samples.push_back(sample);
  }
  std::vector<MoverTrack> list;
  for (auto& [id, track] : tracks) list.push_back(std::move(track));
  return list;
}

MoverPath path_of(const MoverTrack& track) {
  constexpr double kStep = 0.5;  // time between two samples of the path [s]
  MoverPath path;
  std::vector<double> speeds;
  const MoverSample* from = nullptr;
  for (const MoverSample& sample : track.samples) {
    ++(sample.observed ? path.observed : path.predicted);
    if (sample.observed) speeds.push_back(sample.velocity.norm());
    const bool last = &sample == &track.samples.back();
    if (from != nullptr && (last || sample.timestamp - from->timestamp >= kStep)) {
      path.length += (sample.centroid - from->centroid).norm();
      from = &sample;
    }
    if (from == nullptr) from = &sample;
  }
  path.mean_speed = compute_statistics(speeds).mean;
  path.max_speed = quantile(speeds, 0.95);
  return path;
}

}  // namespace stillmap
