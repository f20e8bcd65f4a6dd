// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/cloud_chunks.hpp"

#include <cstring>
#include <set>

#include <gmock/gmock.h>

namespace stillmap {
namespace {

using Message = CloudChunks::Message;

std::vector<std::string> topics(const std::vector<Message>& messages) {
  std::vector<std::string> topics;
  for (const Message& message : messages) topics.push_back(message.topic);
  return topics;
}

template <typename T>
T read(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

/// Returns the points of a chunk as a page decodes them.
std::vector<Eigen::Vector3f> decoded_points(const std::string& bytes) {
  std::vector<Eigen::Vector3f> points;
  const float edge = read<float>(bytes, 16);
  for (std::uint32_t i = 0; i < read<std::uint32_t>(bytes, 20); ++i) {
    Eigen::Vector3f p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto cell = static_cast<float>(read<std::int32_t>(bytes, 4 + 4 * axis));
      const auto steps = static_cast<float>(read<std::uint16_t>(bytes, 24 + 8 * i + 2 * axis));
      p[static_cast<int>(axis)] = (cell + steps / 65535) * edge;
    }
    points.push_back(p);
  }
  return points;
}

TEST(CloudChunks, PointsAreDecodedToATwentiethOfAMillimeterWithColorAndClass) {
  Cloud cloud;
  cloud.add({-0.5F, 1.25F, 1.999F}, {10, 20, 30});
  const std::vector<std::uint16_t> labels{7};
  const auto messages = CloudChunks().update(cloud, labels);
  ASSERT_THAT(topics(messages), testing::ElementsAre("cloud/-1/0/0"));
  const std::string& bytes = messages[0].bytes;
  EXPECT_EQ(bytes.size(), 24U + 12U);
  EXPECT_EQ(bytes[0], static_cast<char>(BinaryMessage::kCloudChunk));
  EXPECT_LT((decoded_points(bytes).at(0) - cloud.points[0]).norm(), 5e-5F);
  EXPECT_EQ(read<std::uint16_t>(bytes, 30), 7);
  EXPECT_EQ(read<Rgb>(bytes, 32), (Rgb{10, 20, 30}));
}

TEST(CloudChunks, OnlyChangedChunksAreSent) {
  Cloud cloud;
  cloud.add({1, 1, 1}, {});
  cloud.add({3, 1, 1}, {});
  CloudChunks chunks;
  EXPECT_EQ(chunks.update(cloud).size(), 2U);
  EXPECT_TRUE(chunks.update(cloud).empty());
  cloud.points[1].x() += 0.01F;
  EXPECT_THAT(topics(chunks.update(cloud)), testing::ElementsAre("cloud/1/0/0"));
}

TEST(CloudChunks, AChunkThatIsGoneIsSentEmptyAndOnce) {
  Cloud cloud;
  cloud.add({1, 1, 1}, {});
  CloudChunks chunks;
  chunks.update(cloud);
  const auto messages = chunks.update({});
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_TRUE(decoded_points(messages[0].bytes).empty());
  EXPECT_TRUE(chunks.update({}).empty());
}

TEST(CloudChunks, TheFirstPointsOfAChunkAreAnEvenSample) {
  Cloud cloud;
  for (int i = 0; i < 2000; ++i) cloud.add({static_cast<float>(i) * 0.001F, 1, 1}, {});
  const auto points = decoded_points(CloudChunks().update(cloud).at(0).bytes);
  std::set<int> tenths;  // tenths of the line that the first 100 of its 2000 points reach
  for (std::size_t i = 0; i < 100; ++i) tenths.insert(static_cast<int>(points[i].x() * 5));
  EXPECT_EQ(tenths.size(), 10U);
}

}  // namespace
}  // namespace stillmap
