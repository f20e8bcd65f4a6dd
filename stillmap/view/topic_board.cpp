// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/topic_board.hpp"

#include "stillmap/base/json_text.hpp"

#include <utility>

namespace stillmap {

void TopicBoard::publish(const std::string& topic, std::string bytes, bool binary) {
  auto shared = std::make_shared<const std::string>(std::move(bytes));
  {
    const std::unique_lock lock(mutex_);
    std::uint64_t& version = version_of_[topic];
    postings_.erase(version);
    version = ++version_;
    postings_.emplace(version, Posting{version, binary, std::move(shared)});
  }
  changed_.notify_all();
}

void TopicBoard::publish(const nlohmann::json& message) {
  publish(message.at("type").get<std::string>(), json_text(message));
}

void TopicBoard::set_images(std::shared_ptr<RunImages> images) {
  const std::unique_lock lock(mutex_);
  images_ = std::move(images);
}

std::shared_ptr<RunImages> TopicBoard::images() const {
  const std::unique_lock lock(mutex_);
  return images_;
}

std::optional<Posting> TopicBoard::next(std::uint64_t after, const std::stop_token& stop) const {
  std::unique_lock lock(mutex_);
  if (!changed_.wait(lock, stop, [&] { return version_ > after; }) || stop.stop_requested())
    return std::nullopt;
  return postings_.upper_bound(after)->second;
}

std::uint64_t TopicBoard::version() const {
  const std::unique_lock lock(mutex_);
  return version_;
}

}  // namespace stillmap
