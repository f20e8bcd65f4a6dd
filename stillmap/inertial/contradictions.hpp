// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace stillmap {

/// Decides whether a sensor is left out because its newest measurements contradict the images: at
/// least `least` of those that are remembered, and more than a fifth.
class Contradictions {
 public:
  /// @param memory  number of measurements that are remembered
  Contradictions(std::size_t memory, std::size_t least) : memory_(memory), least_(least) {}

  void add(bool contradicts) {
    newest_.push_back(contradicts);
    if (newest_.size() > memory_) newest_.erase(newest_.begin());
  }
  void clear() { newest_.clear(); }
  bool too_many() const {
    const auto count = static_cast<std::size_t>(std::count(newest_.begin(), newest_.end(), true));
    return count >= least_ && 5 * count > newest_.size();
  }

 private:
  std::size_t memory_, least_;
  std::vector<bool> newest_;  // the newest last
};

}  // namespace stillmap
