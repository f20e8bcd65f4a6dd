// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/topic_board.hpp"

#include <thread>
#include <vector>

#include <gmock/gmock.h>

namespace stillmap {
namespace {

/// Returns the texts that a reader gets who has read up to `after` and does not wait.
std::vector<std::string> texts_after(const TopicBoard& board, std::uint64_t after) {
  std::vector<std::string> texts;
  while (after < board.version()) {
    const auto posting = board.next(after, {});
    texts.push_back(*posting->bytes);
    after = posting->version;
  }
  return texts;
}

TEST(TopicBoard, ANewReaderGetsTheNewestMessageOfEachTopicInTheOrderOfPublication) {
  TopicBoard board;
  board.publish("a", "a1");
  board.publish("b", "b1");
  board.publish("a", "a2");
  EXPECT_THAT(texts_after(board, 0), testing::ElementsAre("b1", "a2"));
}

TEST(TopicBoard, ASlowReaderSkipsReplacedMessagesOnly) {
  TopicBoard board;
  board.publish("frame", "1");
  const std::uint64_t read = board.next(0, {})->version;
  board.publish("event", "lost");
  for (int i = 2; i < 1000; ++i) board.publish("frame", std::to_string(i));
  EXPECT_THAT(texts_after(board, read), testing::ElementsAre("lost", "999"));
}

TEST(TopicBoard, AReaderThatWaitsIsWokenByAPublicationAndByAStop) {
  TopicBoard board;
  std::vector<std::string> read;
  std::jthread reader([&](const std::stop_token& stop) {
    std::uint64_t version = 0;
    while (const auto posting = board.next(version, stop)) {
      read.push_back(*posting->bytes);
      version = posting->version;
    }
  });
  board.publish("a", "1");
  while (true) {
    board.publish("a", "2");
    if (board.version() > 3) break;
  }
  reader.request_stop();
  reader.join();
  EXPECT_FALSE(board.next(board.version(), reader.get_stop_token()).has_value());
}

}  // namespace
}  // namespace stillmap
