// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/frame.hpp"
#include "stillmap/segment/instance.hpp"

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// What a thing's class says about its moving.
enum class ClassRole {
  kDynamic,    ///< moves by itself: taken for moving when it is seen
  kPotential,  ///< stands until somebody moves it: to be tested
  kStatic,     ///< stays where it is: not in doubt
  kUnlisted,   ///< on no list: says nothing
};

/// Which classes play which role, by the names that the network (or a folder of masks) gives them.
/// A class on several lists has the first one's role.
struct ClassSets {
  std::vector<std::string> dynamic;         ///< of ClassRole::kDynamic
  std::vector<std::string> potential;       ///< of ClassRole::kPotential
  std::vector<std::string> standing_still;  ///< of ClassRole::kStatic

  ClassRole role_of(const std::string& class_name) const;
};

/// People, and "unknown", which is what a folder of masks calls the things in it.
ClassSets people_classes();

/// COCO's classes as the box-based systems sort them: people, animals and vehicles move; what is
/// carried and pushed about (chair, book, cup, ...) may; furniture and kitchen machines do not.
ClassSets indoor_classes();

/// Boxes of the instances whose class plays that role, in the order of the instances; masks do not
/// matter. `frame` may be null.
std::vector<cv::Rect> boxes_with_role(const SegmentedFramePtr& frame, const ClassSets& classes,
                                      ClassRole role);

/// Whether pixel (u, v) lies in one of the boxes. Pixel i is the stretch i - 1/2 to i + 1/2.
bool in_any_box(const std::vector<cv::Rect>& boxes, float u, float v);

/// Marks the box, as far as it lies inside the image, in evidence.moving_pixels, which is made if
/// it is empty.
void mark_moving(const cv::Rect& box, cv::Size image, MotionEvidence& evidence);

}  // namespace stillmap
