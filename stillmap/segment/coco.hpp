// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace stillmap {

/// Returns the 80 class names of COCO (Lin et al., ECCV 2014) in the order of YOLO networks.
const std::vector<std::string>& coco_class_names();

/// Returns the same by the category ids of COCO's annotations, 0 to 90; unused ids are "class
/// <id>".
const std::vector<std::string>& coco_names_by_id();

/// Returns the class of COCO for a class name of a network: ignores case, and maps people,
/// pedestrian and human to person. Other names are returned unchanged.
std::string coco_class_name(const std::string& name);

}  // namespace stillmap
