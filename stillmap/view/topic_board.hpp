// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include <nlohmann/json.hpp>

namespace stillmap {

class RunImages;

/// A message on a board.
struct Posting {
  std::uint64_t version = 0;                 ///< Number of the publication: 1, 2, 3 ...
  bool binary = false;                       ///< Whether the bytes are binary; otherwise JSON.
  std::shared_ptr<const std::string> bytes;  ///< Never null.
};

/// The newest message of every topic, for any number of readers. A message replaces the older one
/// of its topic, so a slow reader skips messages instead of making anybody wait, and the memory is
/// that of one message per topic. Each reader keeps the version that it has read up to; a reader
/// that begins at version 0 gets the whole present state. Images of a finished run are too many to
/// be messages; readers ask for them. May be used by any thread.
class TopicBoard {
 public:
  /// Replaces the message of a topic.
  void publish(const std::string& topic, std::string bytes, bool binary = false);
  /// Replaces the message of the topic that its member "type" names.
  void publish(const nlohmann::json& message);

  /// Sets where images of a finished run come from.
  void set_images(std::shared_ptr<RunImages> images);
  /// Returns where they come from; null: there are none.
  std::shared_ptr<RunImages> images() const;

  /// Waits for the oldest posting that is newer than a version and returns it; none if a stop is
  /// requested first.
  std::optional<Posting> next(std::uint64_t after, const std::stop_token& stop) const;

  /// Returns the number of publications so far.
  std::uint64_t version() const;

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  std::uint64_t version_ = 0;
  std::map<std::string, std::uint64_t> version_of_;  // by topic
  std::map<std::uint64_t, Posting> postings_;        // by version
  std::shared_ptr<RunImages> images_;
};

}  // namespace stillmap
