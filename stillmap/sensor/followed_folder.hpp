// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <chrono>
#include <functional>
#include <memory>

namespace stillmap {

/// A folder into which another program still writes images. next() waits for the next frame until
/// Following tells to stop. The frames are those that the complete folder gives.
class FollowedFolder : public FrameSource {
 public:
  /// Opens the folder; `growing` becomes SequencePaths::growing.
  using Open = std::function<std::unique_ptr<TumFolder>(bool growing)>;

  /// Waits until the folder has a usable frame. Throws the Error of `open` if none has come in
  /// time.
  FollowedFolder(const Open& open, Following following);

  const Camera& camera() const override { return folder_->camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return std::nullopt; }
  const std::vector<SkippedFrame>& skipped() const override { return folder_->skipped(); }
  std::vector<std::string> notes() const override { return folder_->notes(); }
  std::vector<Finding> findings() const override { return folder_->findings(); }

 private:
  using Clock = std::chrono::steady_clock;
  bool wait_a_little() const;

  Following following_;
  std::unique_ptr<TumFolder> folder_;
  Clock::time_point newest_ = Clock::now();  // when the last frame came
  bool complete_ = false;                    // no more frames are expected
};

}  // namespace stillmap
