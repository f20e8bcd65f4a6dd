// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/instance.hpp"
#include "stillmap/segment/propagation_options.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <deque>
#include <memory>

namespace stillmap {

/// Carries the instances found in `source_frame` forward to the later `target_frame`: each mask is
/// cut into squares, optical flow moves them, and the depth image mends the outline. Instances
/// without a mask are taken to fill their box, less what lies behind, and do not outgrow it as it
/// moves. Those of which nothing is left in the target are
/// dropped. A pure function of its arguments.
///
/// `source.frame_index` is `source_frame.index`; the result is in the pixels of `target_frame` and
/// keeps `source.source_index`, so its age is known. Both frames have one size.
SegmentedFrame propagate_masks(const SegmentedFrame& source, const RgbdFrame& source_frame,
                               const RgbdFrame& target_frame,
                               const PropagationOptions& options = {});

/// Takes out of each mask what the depth image shows to be background: see drop_background. What
/// propagate_masks does to its source first; good for fresh masks too.
SegmentedFrame trim_by_depth(const SegmentedFrame& masks, const RgbdFrame& frame,
                             const PropagationOptions& options = {});

struct PropagationSource;  // a segmented frame made ready to be carried

/// Gives every frame masks, although the network saw only some of them, some time ago: push every
/// frame; set masks whenever there are new ones; current() is the newest masks carried to the
/// newest frame. What it returns depends only on the frames pushed, the masks set, and where
/// current() was called between: flow goes on from where it was found last. One thread at a time.
class MaskPropagator {
 public:
  explicit MaskPropagator(const PropagationOptions& options = {});
  ~MaskPropagator();
  MaskPropagator(MaskPropagator&&) noexcept;
  MaskPropagator& operator=(MaskPropagator&&) noexcept;

  /// The next frame; indices rise.
  void push(RgbdFramePtr frame);
  /// Masks found in a frame that was pushed not more than `max_age` frames ago. Older masks than
  /// those held already, or masks of frames no longer held, are ignored.
  void set(const SegmentedFrame& masks);
  /// Masks in the pixels of the newest frame; null if there are none yet, or only ones that are too
  /// old.
  SegmentedFramePtr current();

 private:
  PropagationOptions options_;
  std::deque<RgbdFramePtr> frames_;  // the last max_age + 1
  std::unique_ptr<PropagationSource> source_;
};

}  // namespace stillmap
