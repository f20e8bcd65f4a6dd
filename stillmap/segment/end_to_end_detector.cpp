// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/end_to_end_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/segment/coco.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kDets = "dets";
constexpr const char* kMasks = "masks";

using Shape = std::vector<std::int64_t>;

std::optional<std::size_t> index_of(const std::string& name,
                                    const std::vector<std::string>& names) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

/// Mean and standard deviation of ImageNet's pixels, of bytes.
PixelFormat imagenet_format(bool bgr) {
  constexpr std::array<float, 3> kMean = {103.53F, 116.28F, 123.675F};  // blue, green, red
  constexpr std::array<float, 3> kDeviation = {57.375F, 57.12F, 58.395F};
  PixelFormat format{.bgr = bgr};
  for (std::size_t c = 0; c < 3; ++c) {
    format.scale[c] = 1 / kDeviation[c];
    format.offset[c] = -kMean[c] / kDeviation[c];
  }
  return format;
}

/// Detections as rows of an end-to-end YOLO network: x1, y1, x2, y2 [input pixels], score, class.
constexpr std::size_t kRow = 6;

void append_query(std::span<const float> box, std::span<const float> logits, cv::Size input,
                  std::vector<float>& rows) {
  const auto width = static_cast<float>(input.width), height = static_cast<float>(input.height);
  const float x = box[0] * width, half_width = box[2] * width / 2;
  const float y = box[1] * height, half_height = box[3] * height / 2;
  const auto best = std::ranges::max_element(logits);
  rows.insert(rows.end(), {x - half_width, y - half_height, x + half_width, y + half_height,
                           1 / (1 + std::exp(-*best)), static_cast<float>(best - logits.begin())});
}

std::vector<float> rows_of_queries(const TensorView& dets, const TensorView& labels,
                                   std::size_t classes, cv::Size input) {
  const auto columns = static_cast<std::size_t>(labels.shape[2]);
  std::vector<float> rows;
  for (std::size_t i = 0; i < static_cast<std::size_t>(dets.shape[1]); ++i)
    append_query(dets.values.subspan(4 * i, 4), labels.values.subspan(columns * i, classes), input,
                 rows);
  return rows;
}

std::vector<float> rows_of_detections(const TensorView& dets, const TensorView& labels) {
  std::vector<float> rows;
  for (std::size_t i = 0; i < labels.values.size(); ++i) {
    const auto box_and_score = dets.values.subspan(5 * i, 5);
    rows.insert(rows.end(), box_and_score.begin(), box_and_score.end());
    rows.push_back(labels.values[i]);
  }
  return rows;
}

/// Returns plane `i` of the masks as the only prototype of a network.
TensorView plane(const TensorView& masks, std::size_t i) {
  const auto area = static_cast<std::size_t>(masks.shape[2] * masks.shape[3]);
  return {{1, 1, masks.shape[2], masks.shape[3]}, masks.values.subspan(i * area, area)};
}

}  // namespace

EndToEndShape recognize_end_to_end(const std::vector<std::string>& names,
                                   const std::vector<Shape>& shapes, const std::string& where) {
  EndToEndShape shape{.queries = false,
                      .dets = index_of(kDets, names).value(),
                      .labels = index_of(kLabels, names).value(),
                      .masks = index_of(kMasks, names)};
  const Shape& dets = shapes[shape.dets];
  const Shape& labels = shapes[shape.labels];
  const bool boxes = dets.size() == 3 && dets[0] == 1 && labels.size() > 1 && labels[0] == 1 &&
                     labels[1] == dets[1];
  shape.queries = boxes && dets[2] == 4 && labels.size() == 3 && labels[2] > 1;
  const bool detections = boxes && dets[2] == 5 && labels.size() == 2;
  const bool masks =
      !shape.masks || (shapes[*shape.masks].size() == 4 && shapes[*shape.masks][0] == 1);
  if ((shape.queries || detections) && masks) return shape;
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i)
    list += fmt::format(" {} [{}]", names[i], fmt::join(shapes[i], ", "));
  throw Error("the outputs fit neither RF-DETR nor RTMDet:" + list, where,
              "export RF-DETR with `model.export()` (rfdetr), or RTMDet with MMDeploy for ONNX "
              "Runtime");
}

std::vector<std::string> names_of_columns(std::vector<std::string> names, std::size_t columns,
                                          const std::string& where) {
  if (names.empty() && columns == coco_names_by_id().size()) return coco_names_by_id();
  if (names.size() == columns || names.size() + 1 == columns) return names;
  throw Error(fmt::format("the network has {} columns of classes, but the names of {} classes are "
                          "known",
                          columns, names.size()),
              where, "write the class names into its metadata: names = {0: 'person', ...}");
}

std::vector<Instance> decode_end_to_end(std::span<const TensorView> outputs,
                                        const EndToEndShape& shape, const Letterbox& letterbox,
                                        float min_confidence,
                                        const std::vector<std::string>& class_names) {
  const TraceScope scope("decode");
  const TensorView& dets = outputs[shape.dets];
  const TensorView& labels = outputs[shape.labels];
  const std::vector<float> rows =
      shape.queries ? rows_of_queries(dets, labels, class_names.size(), letterbox.input)
                    : rows_of_detections(dets, labels);
  YoloShape layout;
  layout.classes = static_cast<int>(class_names.size());
  layout.end_to_end = true;
  layout.attributes_first = false;
  layout.anchors = rows.size() / kRow;
  std::vector<Candidate> candidates = read_detections({{}, rows}, layout, min_confidence);
  if (shape.masks) {
    const std::int64_t masks = outputs[*shape.masks].shape[1];
    std::erase_if(candidates,
                  [&](const Candidate& c) { return static_cast<std::int64_t>(c.anchor) >= masks; });
  }
  constexpr float kKeepAll = 1;  // No intersection over union is greater.
  const auto mask_of = [&](const Candidate& candidate, const cv::Rect& box) {
    if (!shape.masks) return cv::Mat();
    constexpr std::array<float, 1> kWeight = {1};
    const float threshold = shape.queries ? 0 : 0.5F;  // of logits or of probabilities
    return assemble_mask(plane(outputs[*shape.masks], candidate.anchor), kWeight, letterbox, box,
                         threshold);
  };
  return to_instances(suppress_overlaps(std::move(candidates), kKeepAll, kMaxInstances), letterbox,
                      class_names, mask_of);
}

bool EndToEndDetector::fits(const Network& network) {
  return index_of(kDets, network.output_names()) && index_of(kLabels, network.output_names());
}

EndToEndDetector::EndToEndDetector(Network network)
    : NetworkDetector(std::move(network)),
      shape_(recognize_end_to_end(network_.output_names(), network_.output_shapes(),
                                  network_.options().model)) {
  if (shape_.queries) {
    const auto columns = network_.output_shapes()[shape_.labels][2];
    class_names_ = names_of_columns(std::move(class_names_), static_cast<std::size_t>(columns),
                                    network_.options().model);
  } else if (class_names_.empty()) {
    class_names_ = coco_class_names();
  }
}

std::vector<Instance> EndToEndDetector::detect(const RgbdFrame& frame) {
  const cv::Size image = frame.color.size(), input = network_.input_size();
  const Letterbox letterbox =
      shape_.queries ? Letterbox::stretched(image, input) : Letterbox::in_corner(image, input);
  const auto& outputs = network_.run_on(frame.color, letterbox, imagenet_format(!shape_.queries));
  return decode_end_to_end(outputs, shape_, letterbox, network_.options().confidence, class_names_);
}

}  // namespace stillmap
