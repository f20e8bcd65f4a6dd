// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/frame_tree.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/messages.hpp"

#include <deque>

namespace stillmap {

void FrameTree::read(bool fixed) {
  constexpr int kTransforms = 1000;  // Number of messages of /tf that are read.
  int read = 0;
  for (const MessageEntry& entry : recording_->messages()) {
    const Topic& topic = recording_->topics()[entry.topic];
    if (topic.type != "tf2_msgs/TFMessage" && topic.type != "tf/tfMessage") continue;
    if (topic.name.ends_with("tf_static") != fixed) continue;
    if (!fixed && ++read > kTransforms) return;
    const auto transforms =
        if_readable([&] { return decode_transforms(recording_->read(entry), topic.encoding); });
    if (!transforms) continue;
    for (const auto& [parent, child, T_parent_child] : *transforms) {
      neighbors_[parent].emplace(child, T_parent_child);
      neighbors_[child].emplace(parent, T_parent_child.inverse());
    }
  }
}

std::optional<Pose> FrameTree::find(const std::string& a, const std::string& b) {
  if (!has_fixed_) read(/*fixed=*/true);
  has_fixed_ = true;
  if (const auto T_a_b = chain(a, b); T_a_b || has_all_) return T_a_b;
  read(/*fixed=*/false);
  has_all_ = true;
  return chain(a, b);
}

std::optional<Pose> FrameTree::chain(const std::string& a, const std::string& b) const {
  std::map<std::string, Pose> T_a_reached{{a, Pose()}};
  std::deque<std::string> open{a};
  while (!open.empty()) {
    const std::string frame = open.front();
    open.pop_front();
    if (frame == b) return T_a_reached.at(b);
    const auto found = neighbors_.find(frame);
    if (found == neighbors_.end()) continue;
    for (const auto& [neighbor, T_frame_neighbor] : found->second) {
      if (T_a_reached.emplace(neighbor, T_a_reached.at(frame) * T_frame_neighbor).second)
        open.push_back(neighbor);
    }
  }
  return std::nullopt;
}

}  // namespace stillmap
