// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_propagator.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/segment/mask_depth.hpp"
#include "stillmap/segment/mask_flow.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// The lengths below are in pixels of the full image and were tuned on people at 1 to 4 m in
// 640 x 480 images, against true masks.

/// Growth of the outline's uncertainty per frame of age [pixels].
constexpr double kGrowth = 1.5;
/// Uncertainty of the outline at age 0 [pixels].
constexpr double kBaseGrowth = 2;
/// Width up to which holes and bays may be filled again [pixels].
constexpr int kFilling = 16;

}  // namespace

/// The part of the source that does not depend on the target, and the last flow.
struct PropagationSource {
  struct TrackedInstance {
    SmallMask mask;
    MaskGrid grid;
    bool is_box = false;  // Whether only a box is known.
  };
  SegmentedFrame masks;
  FlowFrame frame;
  std::vector<TrackedInstance> tracked;  // One per instance.

  PropagationSource(const SegmentedFrame& segmented, const RgbdFrame& rgbd)
      : masks(segmented), frame(rgbd, FlowFrame::Role::kSource) {
    for (const Instance& instance : masks.instances) {
      SmallMask mask = shrink_mask(instance, frame.small);
      drop_background(mask, frame.small);
      MaskGrid grid = cut_into_cells(mask, frame.small.shrink);
      tracked.push_back({std::move(mask), std::move(grid), instance.mask.empty()});
    }
  }
};

namespace {

/// Returns where a moved mask may grow beyond the uncertainty of its outline: into its own holes
/// and bays, and into regions outside the source image.
cv::Mat1b open_ground(const SmallMask& moved, cv::Point2f flow, const SmallFrame& frame) {
  const TraceScope scope("open ground");
  const int radius = std::max(1, kFilling / frame.shrink / 2);
  const cv::Size kernel(2 * radius + 1, 2 * radius + 1);
  cv::Mat1b open;
  cv::morphologyEx(moved.mask, open, cv::MORPH_CLOSE,
                   cv::getStructuringElement(cv::MORPH_RECT, kernel), cv::Point(-1, -1), 1,
                   cv::BORDER_CONSTANT, cv::Scalar(0));
  const cv::Point shift(cvRound(flow.x), cvRound(flow.y));
  const cv::Rect seen = (frame.bounds() + shift) & moved.window;
  cv::Mat1b unseen(open.size(), 255);
  if (!seen.empty()) unseen(seen - moved.window.tl()) = 0;
  return open | unseen;
}

/// Returns the maximum growth of a mask beyond its moved outline. A mask that was cut off by the
/// image border may extend where the image now shows more.
int reach_of(const SmallMask& mask, cv::Point2f flow, int margin, const SmallFrame& source) {
  const cv::Rect inner(1, 1, source.size().width - 2, source.size().height - 2);
  const bool cut = (mask.window & inner) != mask.window;
  const int come_in = cut ? cvCeil(std::max(std::abs(flow.x), std::abs(flow.y))) : 0;
  return margin + std::max(kFilling / source.shrink, come_in);
}

/// Returns the bounds of the moved box. A side on the border of the source image is open, since the
/// box continued beyond it.
cv::Rect moved_box(const cv::Rect& box, cv::Point2f flow, int margin, const cv::Rect& image) {
  const cv::Point shift(cvRound(flow.x), cvRound(flow.y));
  cv::Point low = box.tl() + shift - cv::Point(margin, margin);
  cv::Point high = box.br() + shift + cv::Point(margin, margin);
  if (box.x <= image.x) low.x = image.x;
  if (box.y <= image.y) low.y = image.y;
  if (box.br().x >= image.br().x) high.x = image.br().x;
  if (box.br().y >= image.br().y) high.y = image.br().y;
  return low.x < high.x && low.y < high.y ? cv::Rect(low, high) & image : cv::Rect();
}

void clip(MovedMask& moved, const cv::Rect& limits) {
  SmallMask& mask = moved.small;
  const cv::Rect kept = mask.window & limits, inner = kept - mask.window.tl();
  mask.window = kept;
  if (kept.empty()) return;
  mask.mask = mask.mask(inner).clone();
  moved.depth = moved.depth(inner).clone();
}

/// If only a box is known, the propagated mask must not grow beyond it, since wall and floor near a
/// person belong to the surfaces in the box.
SmallMask propagate_instance(PropagationSource::TrackedInstance& instance, const FlowFrame& source,
                             const FlowFrame& target, std::size_t age) {
  const int shrink = source.small.shrink;
  const double uncertainty = kBaseGrowth + kGrowth * static_cast<double>(age);
  const int margin = cvCeil(uncertainty / shrink);
  follow_cells(instance.grid, source, target, age);
  const cv::Point2f flow = common_flow(instance.grid);
  MovedMask moved = move_mask(instance.mask, instance.grid, source.small,
                              reach_of(instance.mask, flow, margin, source.small));
  if (instance.is_box) {
    clip(moved, moved_box(instance.mask.window, flow, margin, source.small.bounds()));
  }
  if (moved.small.window.empty()) return {};
  const cv::Mat1b open = open_ground(moved.small, flow, target.small);
  drop_others(moved, target.small);
  grow_on_surface(moved.small, target.small, margin, {});
  grow_on_surface(moved.small, target.small, target.small.size().width, open);
  return moved.small;
}

SegmentedFrame propagate(PropagationSource& source, const RgbdFrame& target_frame) {
  SegmentedFrame propagated{.frame_index = target_frame.index,
                            .source_index = source.masks.source_index,
                            .instances = {}};
  if (source.masks.instances.empty()) return propagated;
  const FlowFrame target(target_frame, FlowFrame::Role::kTarget);
  for (std::size_t i = 0; i < source.tracked.size(); ++i) {
    const SmallMask mask =
        propagate_instance(source.tracked[i], source.frame, target, propagated.age());
    Instance instance = enlarge_mask(mask, target.small, source.masks.instances[i]);
    if (!instance.box.empty()) propagated.instances.push_back(std::move(instance));
  }
  return propagated;
}

}  // namespace

SegmentedFrame propagate_masks(const SegmentedFrame& source, const RgbdFrame& source_frame,
                               const RgbdFrame& target_frame) {
  PropagationSource prepared(source, source_frame);
  return propagate(prepared, target_frame);
}

SegmentedFrame trim_by_depth(const SegmentedFrame& masks, const RgbdFrame& frame) {
  const SmallFrame small(frame);
  SegmentedFrame trimmed{
      .frame_index = masks.frame_index, .source_index = masks.source_index, .instances = {}};
  for (const Instance& instance : masks.instances) {
    SmallMask mask = shrink_mask(instance, small);
    drop_background(mask, small);
    Instance result = enlarge_mask(mask, small, instance);
    if (!result.box.empty()) trimmed.instances.push_back(std::move(result));
  }
  return trimmed;
}

MaskPropagator::MaskPropagator(int max_age) : max_age_(static_cast<std::size_t>(max_age)) {}
MaskPropagator::~MaskPropagator() = default;
MaskPropagator::MaskPropagator(MaskPropagator&&) noexcept = default;
MaskPropagator& MaskPropagator::operator=(MaskPropagator&&) noexcept = default;

void MaskPropagator::push(RgbdFramePtr frame) {
  frames_.push_back(std::move(frame));
  while (frames_.size() > max_age_ + 1) frames_.pop_front();
}

void MaskPropagator::set(const SegmentedFrame& masks) {
  const TraceScope scope("new masks");
  if (source_ && masks.source_index <= source_->masks.source_index) return;
  const auto is_source = [&](const auto& frame) { return frame->index == masks.frame_index; };
  const auto frame = std::find_if(frames_.begin(), frames_.end(), is_source);
  if (frame == frames_.end()) return;
  source_ = std::make_unique<PropagationSource>(masks, **frame);
}

SegmentedFramePtr MaskPropagator::current() {
  const TraceScope scope("propagate");
  if (!source_ || frames_.empty()) return nullptr;
  const RgbdFrame& target = *frames_.back();
  const std::size_t found_in = source_->masks.frame_index;
  if (target.index == found_in) return std::make_shared<SegmentedFrame>(source_->masks);
  if (target.index - found_in > max_age_) return nullptr;
  return std::make_shared<SegmentedFrame>(propagate(*source_, target));
}

}  // namespace stillmap
