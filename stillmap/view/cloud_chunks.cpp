// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/cloud_chunks.hpp"

#include "stillmap/base/stopwatch.hpp"
#include "stillmap/view/message_bytes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr float kSteps = 65535;  // a coordinate within a chunk has 16 bits

std::uint16_t quantized(float offset) {
  return static_cast<std::uint16_t>(
      std::clamp(std::round(offset / CloudChunks::kEdge * kSteps), 0.0F, kSteps));
}

/// Returns the message of one chunk; see docs/view.md.
std::string chunk_bytes(const std::array<std::int32_t, 3>& cell, const Cloud& cloud,
                        std::span<const std::uint16_t> labels,
                        const std::vector<std::uint32_t>& points) {
  MessageBytes bytes(BinaryMessage::kCloudChunk);
  bytes.reserve(32 + 12 * points.size());
  for (const std::int32_t coordinate : cell) bytes.add(coordinate);
  bytes.add(CloudChunks::kEdge);
  bytes.add(static_cast<std::uint32_t>(points.size()));
  for (const std::uint32_t i : points) {
    for (int axis = 0; axis < 3; ++axis) {
      const float origin = static_cast<float>(cell[static_cast<std::size_t>(axis)]);
      bytes.add(quantized(cloud.points[i][axis] - origin * CloudChunks::kEdge));
    }
    bytes.add(labels.empty() ? std::uint16_t{0} : labels[i]);
  }
  for (const std::uint32_t i : points) {
    bytes.add(cloud.colors[i]);
    bytes.add(std::uint8_t{255});
  }
  return bytes.take();
}

}  // namespace

std::vector<CloudChunks::Message> CloudChunks::update(const Cloud& cloud,
                                                      std::span<const std::uint16_t> labels) {
  std::map<Cell, std::vector<std::uint32_t>> points;
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[static_cast<std::size_t>(axis)] =
          static_cast<std::int32_t>(std::floor(cloud.points[i][axis] / kEdge));
    }
    points[cell].push_back(i);
  }
  for (const auto& [cell, hash] : hashes_) points.try_emplace(cell);
  std::vector<Message> changed;
  std::map<Cell, std::size_t> hashes;
  for (auto& [cell, indices] : points) {
    std::mt19937 random(1);  // NOLINT(cert-msc51-cpp): the same order for the same points
    std::shuffle(indices.begin(), indices.end(), random);
    std::string bytes = chunk_bytes(cell, cloud, labels, indices);
    const std::size_t hash = std::hash<std::string>()(bytes);
    const auto before = hashes_.find(cell);
    if (!indices.empty()) hashes[cell] = hash;
    if (before != hashes_.end() && before->second == hash) continue;
    changed.push_back({fmt::format("cloud/{}/{}/{}", cell[0], cell[1], cell[2]), std::move(bytes)});
  }
  hashes_ = std::move(hashes);
  return changed;
}

MapCost publish_changes(TopicBoard& board, CloudChunks& chunks, const Cloud& cloud,
                        std::span<const std::uint16_t> labels) {
  const Stopwatch watch;
  auto changed = chunks.update(cloud, labels);
  MapCost cost{.changed_chunks = changed.size()};
  for (auto& [topic, bytes] : changed) {
    cost.bytes += bytes.size();
    board.publish(topic, std::move(bytes), true);
  }
  cost.milliseconds = watch.milliseconds();
  return cost;
}

}  // namespace stillmap
