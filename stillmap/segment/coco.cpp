// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/coco.hpp"

#include <algorithm>
#include <cctype>
#include <set>

namespace stillmap {

const std::vector<std::string>& coco_class_names() {
  static const std::vector<std::string> kNames = {"person",        "bicycle",      "car",
                                                  "motorcycle",    "airplane",     "bus",
                                                  "train",         "truck",        "boat",
                                                  "traffic light", "fire hydrant", "stop sign",
                                                  "parking meter", "bench",        "bird",
                                                  "cat",           "dog",          "horse",
                                                  "sheep",         "cow",          "elephant",
                                                  "bear",          "zebra",        "giraffe",
                                                  "backpack",      "umbrella",     "handbag",
                                                  "tie",           "suitcase",     "frisbee",
                                                  "skis",          "snowboard",    "sports ball",
                                                  "kite",          "baseball bat", "baseball glove",
                                                  "skateboard",    "surfboard",    "tennis racket",
                                                  "bottle",        "wine glass",   "cup",
                                                  "fork",          "knife",        "spoon",
                                                  "bowl",          "banana",       "apple",
                                                  "sandwich",      "orange",       "broccoli",
                                                  "carrot",        "hot dog",      "pizza",
                                                  "donut",         "cake",         "chair",
                                                  "couch",         "potted plant", "bed",
                                                  "dining table",  "toilet",       "tv",
                                                  "laptop",        "mouse",        "remote",
                                                  "keyboard",      "cell phone",   "microwave",
                                                  "oven",          "toaster",      "sink",
                                                  "refrigerator",  "book",         "clock",
                                                  "vase",          "scissors",     "teddy bear",
                                                  "hair drier",    "toothbrush"};
  return kNames;
}

const std::vector<std::string>& coco_names_by_id() {
  static const std::vector<std::string> names = [] {
    const std::set<int> unused = {0, 12, 26, 29, 30, 45, 66, 68, 69, 71, 83};
    std::vector<std::string> by_id;
    auto next = coco_class_names().begin();
    for (int id = 0; next != coco_class_names().end() || unused.contains(id); ++id)
      by_id.push_back(unused.contains(id) ? "class " + std::to_string(id) : *next++);
    return by_id;
  }();
  return names;
}

std::string coco_class_name(const std::string& name) {
  std::string small = name;
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const char* of_people : {"people", "persons", "pedestrian", "pedestrians", "human"})
    if (small == of_people) return "person";
  const auto& known = coco_class_names();
  return std::find(known.begin(), known.end(), small) != known.end() ? small : name;
}

}  // namespace stillmap
