// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace stillmap {

/// The 80 classes of COCO (Lin et al., ECCV 2014) in the order that YOLO networks use.
const std::vector<std::string>& coco_class_names();

}  // namespace stillmap
