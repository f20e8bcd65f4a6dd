// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_range.hpp"
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/sensor/rectifier.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A recorded sequence in the layout of the TUM RGB-D benchmark (Sturm et al., IROS 2012), or in
/// another layout that find_sequence() knows.
class TumFolder : public FrameSource {
 public:
  /// @param camera  the recording camera; frames are rectified if it is distorted. Color images
  /// that are larger than the depth images are scaled to the size of the camera: see ImageSizes
  /// Throws Error for invalid lists (see list_frames()), ranges out of range, and if no frame is
  /// usable (all images missing, of the wrong type, or not of the camera's size), or
  /// if 16-bit depth would be in units of more than 0.1 m.
  TumFolder(const SequencePaths& paths, const Camera& camera, const FrameRange& range = {});

  const Camera& camera() const override { return rectifier_.camera(); }
  RgbdFramePtr next() override;
  std::optional<std::size_t> size() const override { return list_.frames.size() - position_; }
  const std::vector<SkippedFrame>& skipped() const override { return list_.skipped; }
  std::vector<std::string> notes() const override;
  std::vector<Finding> findings() const override { return rectifier_.findings(); }
  void add_note(const std::string& note) { notes_.push_back(note); }
  /// Lists the folder again, which has grown since; frames that were returned are not repeated.
  /// @param growing  as SequencePaths::growing
  void refresh(bool growing);
  /// Returns whether the range has a largest number of frames, and the folder as many.
  bool range_is_complete() const { return range_is_complete_; }
  const Rectifier& rectifier() const { return rectifier_; }
  /// Returns the selected frames, usable or not, in order.
  const std::vector<FrameFiles>& frames() const { return list_.frames; }

 private:
  FrameList list_range();
  void require_one_usable_frame() const;
  void require_possible_unit(const std::filesystem::path& depth) const;
  void skip(const SkippedFrame& frame);
  RgbdFramePtr load(const FrameFiles& files);
  cv::Mat load_depth(const FrameFiles& files);

  SequencePaths paths_;
  FrameRange range_;
  Rectifier rectifier_;
  DisparityBias disparity_bias_;
  bool range_is_complete_ = false;
  FrameList list_;
  cv::Size color_size_;                 // of the recorded color images
  std::vector<SkippedFrame> unusable_;  // of list_.skipped, those whose images were opened
  std::vector<std::string> notes_;
  std::size_t position_ = 0;    // index of the next pair in list_.frames
  std::size_t next_index_ = 0;  // index of the next returned frame
};

}  // namespace stillmap
