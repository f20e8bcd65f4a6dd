// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <deque>
#include <memory>

namespace stillmap {

/// Propagates the instances of `source_frame` to the later `target_frame`: each mask is divided
/// into cells that move with the optical flow, and the outline is corrected by the depth image.
/// Instances without a mask are assumed to fill their box, without background, and never grow
/// beyond the moved box. Instances without remaining pixels are dropped. A pure function of its
/// arguments.
///
/// `source.frame_index` is `source_frame.index`; the result is in pixels of `target_frame` and
/// keeps `source.source_index`, so its age is known. Both frames have the same size.
SegmentedFrame propagate_masks(const SegmentedFrame& source, const RgbdFrame& source_frame,
                               const RgbdFrame& target_frame);

/// Removes background from each mask by depth: see drop_background(). propagate_masks() applies it
/// to its source first; also useful for new masks.
SegmentedFrame trim_by_depth(const SegmentedFrame& masks, const RgbdFrame& frame);

struct PropagationSource;  // A segmented frame prepared for propagation.

/// Provides masks for every frame, although the network processes only some frames with a delay:
/// push every frame, set masks when available; current() returns the newest masks propagated to the
/// newest frame. The result depends only on the pushed frames, the masks, and the calls of
/// current(), since flow continues from its last result. One thread at a time.
class MaskPropagator {
 public:
  /// @param max_age maximum age of propagated masks [frames]
  explicit MaskPropagator(int max_age);
  ~MaskPropagator();
  MaskPropagator(MaskPropagator&&) noexcept;
  MaskPropagator& operator=(MaskPropagator&&) noexcept;

  /// Adds the next frame; indices must increase.
  void push(RgbdFramePtr frame);
  /// Sets masks of a frame that was pushed at most `max_age` frames ago. Masks older than the
  /// current ones, or of dropped frames, are ignored.
  void set(const SegmentedFrame& masks);
  /// Returns the masks of the newest frame; null if there are none or they are too old.
  SegmentedFramePtr current();

 private:
  std::size_t max_age_;
  std::deque<RgbdFramePtr> frames_;  // the last max_age + 1 frames
  std::unique_ptr<PropagationSource> source_;
};

}  // namespace stillmap
