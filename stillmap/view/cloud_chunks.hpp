// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/view/topic_board.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace stillmap {

/// Types of binary messages; the first byte of each. docs/view.md has the formats.
enum class BinaryMessage : std::uint8_t { kCloudChunk = 1, kFrameImage = 2, kPath = 3, kMesh = 4 };

/// Cuts a cloud into cubes (chunks) of kEdge, and finds those that have changed. The points of a
/// chunk are in random order, so that the first n of them are an even sample: pages draw as many as
/// they can.
class CloudChunks {
 public:
  static constexpr float kEdge = 2;  ///< Side of a chunk [m].

  struct Message {
    std::string topic;  ///< "cloud/x/y/z", in chunks from the origin.
    std::string bytes;
  };

  /// Returns the messages of the chunks that differ from those of the previous call; an empty chunk
  /// for one that is no longer there.
  /// @param labels  class of each point, 0 for none; or empty
  std::vector<Message> update(const Cloud& cloud, std::span<const std::uint16_t> labels = {});

 private:
  using Cell = std::array<std::int32_t, 3>;
  std::map<Cell, std::size_t> hashes_;  // of the present chunks' messages
};

/// The cost of a state of the map.
struct MapCost {
  std::size_t changed_chunks = 0;
  std::size_t bytes = 0;    ///< Size of the messages of these chunks [bytes].
  double milliseconds = 0;  ///< Time to make all messages of the state [ms].
};

/// Publishes the chunks of a cloud that have changed, and returns their cost.
MapCost publish_changes(TopicBoard& board, CloudChunks& chunks, const Cloud& cloud,
                        std::span<const std::uint16_t> labels = {});

}  // namespace stillmap
