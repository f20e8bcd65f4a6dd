// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace stillmap {

/// Returns the 80 class names of COCO (Lin et al., ECCV 2014) in the order of YOLO networks.
const std::vector<std::string>& coco_class_names();

/// Returns the class of COCO that a network's own name means: in capitals, or people, pedestrian or
/// human for person. Returns the name itself if there is none.
std::string coco_class_name(const std::string& name);

}  // namespace stillmap
