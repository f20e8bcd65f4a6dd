// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <deque>

namespace stillmap {

/// How masks are carried from the frame they were found in to a later one.
struct CarryOptions {
  double growth =
      1.0;           ///< the margin around a carried mask grows by this per frame of age [pixels]
  int max_age = 30;  ///< older masks are not carried: there are none then [frames]
  STILLMAP_FIELDS(growth, max_age)
};

/// Carries the instances found in `source_frame` forward to the later `target_frame`. A pure
/// function of its arguments. `source.frame_index` is `source_frame.index`; the result is in the
/// pixels of `target_frame` and keeps `source.source_index`, so its age is known.
SegmentedFrame carry_forward(const SegmentedFrame& source, const RgbdFrame& source_frame,
                             const RgbdFrame& target_frame, const CarryOptions& options = {});

/// Gives every frame masks, although the network saw only some of them, some time ago: push every
/// frame; set masks whenever there are new ones; current() is the newest masks carried to the
/// newest frame. What it returns depends only on the frames pushed and the masks set.
class MaskCarrier {
 public:
  explicit MaskCarrier(const CarryOptions& options = {}) : options_(options) {}

  /// The next frame; indices rise.
  void push(RgbdFramePtr frame);
  /// Masks found in a frame that was pushed not more than `max_age` frames ago. Older masks than
  /// those held already, or masks for frames no longer held, are ignored.
  void set(SegmentedFramePtr masks);
  /// Masks in the pixels of the newest frame; null if there are none yet, or only ones that are too
  /// old.
  SegmentedFramePtr current() const;

 private:
  CarryOptions options_;
  std::deque<RgbdFramePtr> frames_;  // the last max_age + 1
  SegmentedFramePtr masks_;
};

}  // namespace stillmap
