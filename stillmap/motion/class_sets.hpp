// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/frame.hpp"
#include "stillmap/segment/instance.hpp"

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Evidence for motion from the class of an object.
enum class ClassRole {
  kDynamic,    ///< Moves by itself and counts as moving whenever it is detected.
  kPotential,  ///< May be moved by somebody and is tested.
  kUnlisted,   ///< Gives no evidence.
};

/// The classes of each role, by the names of the network or of a folder of masks. A class in both
/// lists is dynamic.
struct ClassSets {
  std::vector<std::string> dynamic;    ///< Classes of ClassRole::kDynamic.
  std::vector<std::string> potential;  ///< Classes of ClassRole::kPotential.

  ClassRole role_of(const std::string& class_name) const;
};

/// Returns people as dynamic, and "unknown", the class of the objects in a folder of masks.
ClassSets people_classes();

/// Returns COCO's classes as sorted by the box-based systems: people, animals and vehicles are
/// dynamic, portable objects (chair, book, cup, ...) potentially moving.
ClassSets indoor_classes();

/// Returns the boxes of the instances whose class has a role, in the order of the instances.
/// `frame` may be null.
std::vector<cv::Rect> boxes_with_role(const SegmentedFramePtr& frame, const ClassSets& classes,
                                      ClassRole role);

/// Returns whether pixel (u, v) is in one of the boxes. Pixel i extends from i - 1/2 to i + 1/2.
bool in_any_box(const std::vector<cv::Rect>& boxes, float u, float v);

/// Marks the part of the box inside the image in evidence.moving_pixels, which is created if empty.
void mark_moving(const cv::Rect& box, cv::Size image, MotionEvidence& evidence);

}  // namespace stillmap
