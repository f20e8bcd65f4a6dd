// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/yolo_decoder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"

#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

float intersection_over_union(const cv::Rect2f& a, const cv::Rect2f& b) {
  const float shared = (a & b).area();
  const float either = a.area() + b.area() - shared;
  return either > 0 ? shared / either : 0;
}

/// Returns the index of an anchor's first class score: after the box and, if present, the
/// objectness.
std::size_t first_class(const YoloShape& shape) { return shape.objectness ? 5 : 4; }

/// Number of attributes of a detection of an end-to-end network before its mask coefficients.
constexpr std::int64_t kDetectionAttributes = 6;

/// Returns the index of an anchor's first mask coefficient.
std::size_t first_coefficient(const YoloShape& shape) {
  if (shape.end_to_end) return kDetectionAttributes;
  return first_class(shape) + static_cast<std::size_t>(shape.classes);
}

/// Returns the number of attributes per anchor.
std::size_t attribute_count(const YoloShape& shape) {
  return first_coefficient(shape) + static_cast<std::size_t>(shape.mask_coefficients);
}

/// Returns attribute `a` of anchor `i`.
float attribute(const TensorView& boxes, const YoloShape& shape, std::size_t i, std::size_t a) {
  const std::size_t count = attribute_count(shape);
  return boxes.values[shape.attributes_first ? a * shape.anchors + i : i * count + a];
}

/// Computes the best class score of each anchor and its class.
struct BestClasses {
  std::vector<float> score;
  std::vector<int> id;
};

BestClasses best_classes_by_row(const TensorView& boxes, const YoloShape& shape) {
  BestClasses best{std::vector<float>(shape.anchors, 0.0F), std::vector<int>(shape.anchors, 0)};
  for (int c = 0; c < shape.classes; ++c) {
    const float* row =
        boxes.values.data() + (first_class(shape) + static_cast<std::size_t>(c)) * shape.anchors;
    for (std::size_t i = 0; i < shape.anchors; ++i) {
      const bool better = row[i] > best.score[i];
      best.score[i] = better ? row[i] : best.score[i];
      best.id[i] = better ? c : best.id[i];
    }
  }
  return best;
}

BestClasses best_classes_by_anchor(const TensorView& boxes, const YoloShape& shape) {
  BestClasses best{std::vector<float>(shape.anchors, 0.0F), std::vector<int>(shape.anchors, 0)};
  const std::size_t count = attribute_count(shape);
  for (std::size_t i = 0; i < shape.anchors; ++i) {
    const auto scores = boxes.values.subspan(i * count + first_class(shape),
                                             static_cast<std::size_t>(shape.classes));
    const auto top = std::max_element(scores.begin(), scores.end());
    if (*top > 0) best.score[i] = *top;
    best.id[i] = static_cast<int>(top - scores.begin());
  }
  return best;
}

std::vector<float> coefficients_of(const TensorView& boxes, const YoloShape& shape,
                                   std::size_t anchor) {
  std::vector<float> coefficients(static_cast<std::size_t>(shape.mask_coefficients));
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    coefficients[k] = attribute(boxes, shape, anchor, first_coefficient(shape) + k);
  }
  return coefficients;
}

/// Returns the window of the prototypes that a box covers, with one pixel of margin for
/// interpolation.
cv::Rect prototype_window(const TensorView& prototypes, const Letterbox& letterbox,
                          const cv::Rect& box) {
  const auto height = static_cast<int>(prototypes.shape[2]);
  const auto width = static_cast<int>(prototypes.shape[3]);
  const float sx = static_cast<float>(width) / static_cast<float>(letterbox.input.width);
  const float sy = static_cast<float>(height) / static_cast<float>(letterbox.input.height);
  const cv::Point2f low = letterbox.to_input(box.tl()), high = letterbox.to_input(box.br());
  const cv::Point first(cvFloor(low.x * sx) - 1, cvFloor(low.y * sy) - 1);
  const cv::Point last(cvCeil(high.x * sx) + 1, cvCeil(high.y * sy) + 1);
  return cv::Rect(first, last) & cv::Rect(0, 0, width, height);
}

/// Returns the weighted sum of the prototypes within the window: the logits of the mask.
cv::Mat1f weigh_prototypes(const TensorView& prototypes, std::span<const float> coefficients,
                           const cv::Rect& window) {
  const auto width = static_cast<std::size_t>(prototypes.shape[3]);
  const std::size_t plane = width * static_cast<std::size_t>(prototypes.shape[2]);
  cv::Mat1f logits(window.size(), 0.0F);
  for (std::size_t k = 0; k < coefficients.size(); ++k) {
    const float weight = coefficients[k];
    for (int y = 0; y < window.height; ++y) {
      const float* in = prototypes.values.data() + k * plane +
                        static_cast<std::size_t>(window.y + y) * width +
                        static_cast<std::size_t>(window.x);
      float* out = logits.ptr<float>(y);
      for (int x = 0; x < window.width; ++x) out[x] += weight * in[x];
    }
  }
  return logits;
}

/// Interpolation table of one image axis: the two samples around each pixel and the weight.
struct Steps {
  std::vector<int> first, second;
  std::vector<float> weight;  // Weight of the second sample.
};

/// @param position  sample coordinate of a pixel center (sample centers at integers)
template <typename Position>
Steps steps_along(int pixels, int samples, Position&& position) {
  Steps steps;
  for (int i = 0; i < pixels; ++i) {
    const float p = std::clamp(position(i), 0.0F, static_cast<float>(samples - 1));
    const int first = static_cast<int>(p);
    steps.first.push_back(first);
    steps.second.push_back(std::min(first + 1, samples - 1));
    steps.weight.push_back(p - static_cast<float>(first));
  }
  return steps;
}

/// Returns 255 where the bilinear interpolation of the samples is above the threshold.
cv::Mat above_between(const cv::Mat1f& samples, const Steps& columns, const Steps& rows,
                      float threshold) {
  const auto width = columns.first.size(), height = rows.first.size();
  cv::Mat mask(static_cast<int>(height), static_cast<int>(width), CV_8UC1);
  std::vector<float> blended(static_cast<std::size_t>(samples.cols));
  for (std::size_t y = 0; y < height; ++y) {
    const float* a = samples.ptr<float>(rows.first[y]);
    const float* b = samples.ptr<float>(rows.second[y]);
    const float wy = rows.weight[y];
    for (int x = 0; x < samples.cols; ++x) blended[x] = a[x] + wy * (b[x] - a[x]);
    auto* out = mask.ptr<std::uint8_t>(static_cast<int>(y));
    for (std::size_t x = 0; x < width; ++x) {
      const float l = blended[columns.first[x]], r = blended[columns.second[x]];
      out[x] = l + columns.weight[x] * (r - l) > threshold ? 255 : 0;
    }
  }
  return mask;
}

[[noreturn]] void throw_wrong_outputs(const std::vector<std::vector<std::int64_t>>& shapes,
                                      const std::string& where) {
  std::string list;
  for (const auto& shape : shapes) list += fmt::format(" [{}]", fmt::join(shape, ", "));
  throw Error(
      "the outputs fit no YOLOv7, YOLOv8, YOLO11 or YOLOX network, nor DeepLabV3, RF-DETR or "
      "RTMDet:" +
          list,
      where, export_advice());
}

[[noreturn]] void throw_without_classes(const std::string& where) {
  throw Error("the network has no class names, only numbers", where,
              "export it so that its metadata holds the class names: " + export_advice());
}

bool all_positive(const std::vector<std::int64_t>& shape) {
  return std::all_of(shape.begin(), shape.end(), [](std::int64_t n) { return n > 0; });
}

/// Finds the outputs with boxes and, for segmentation networks, prototypes.
YoloShape find_outputs(const std::vector<std::vector<std::int64_t>>& shapes,
                       const std::string& where) {
  std::optional<std::size_t> boxes, prototypes;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!all_positive(shapes[i])) continue;
    if (shapes[i].size() == 3 && shapes[i][0] == 1 && !boxes) boxes = i;
    if (shapes[i].size() == 4 && shapes[i][0] == 1 && !prototypes) prototypes = i;
  }
  if (!boxes) throw_wrong_outputs(shapes, where);
  YoloShape shape;
  shape.boxes_output = *boxes;
  if (prototypes) {
    shape.prototypes_output = *prototypes;
    shape.mask_coefficients = static_cast<int>(shapes[*prototypes][1]);
  }
  return shape;
}

/// Anchor boxes of the standard YOLOv7 per stride (cfg/training/yolov7.yaml) [pixels].
struct StockAnchors {
  int stride;
  std::array<cv::Size2f, 3> sizes;
};
const std::array<StockAnchors, 3> kStockAnchors = {{
    {8, {{{12, 16}, {19, 36}, {40, 28}}}},
    {16, {{{36, 75}, {76, 55}, {72, 146}}}},
    {32, {{{142, 110}, {192, 243}, {459, 401}}}},
}};

bool has_boxes(const std::vector<std::vector<std::int64_t>>& shapes) {
  return std::any_of(shapes.begin(), shapes.end(),
                     [](const auto& s) { return s.size() == 3 && s[0] == 1 && all_positive(s); });
}

/// Returns the outputs [1, 3, height, width, attributes] with a grid of a standard stride.
std::vector<RawHead> find_raw_heads(const std::vector<std::vector<std::int64_t>>& shapes,
                                    cv::Size input) {
  std::vector<RawHead> heads;
  for (const StockAnchors& stock : kStockAnchors) {
    const int height = input.height / stock.stride, width = input.width / stock.stride;
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const auto& s = shapes[i];
      if (s.size() != 5 || !all_positive(s) || s[0] != 1 || s[1] != 3) continue;
      if (s[2] != height || s[3] != width) continue;
      heads.push_back({i, height, width, static_cast<float>(stock.stride), stock.sizes});
    }
  }
  return heads;
}

YoloShape raw_shape(const std::vector<std::vector<std::int64_t>>& shapes,
                    const std::vector<RawHead>& heads, int class_count, const std::string& where) {
  const std::int64_t attributes = shapes[heads.front().output][4];
  const bool agree = std::all_of(heads.begin(), heads.end(), [&](const RawHead& head) {
    return shapes[head.output][4] == attributes;
  });
  YoloShape shape;
  shape.classes = static_cast<int>(attributes) - 5;
  shape.objectness = true;
  shape.raw_heads = heads;
  if (!agree || shape.classes < 1 || (class_count > 0 && class_count != shape.classes)) {
    throw_wrong_outputs(shapes, where);
  }
  return shape;
}

/// Returns the number of cells of the grids of a network's input.
std::int64_t cells_of(cv::Size input) {
  std::int64_t cells = 0;
  for (const StockAnchors& stock : kStockAnchors) {
    cells += static_cast<std::int64_t>(input.height / stock.stride) * (input.width / stock.stride);
  }
  return cells;
}

/// Returns whether the rows of an output are detections, not anchors.
bool is_end_to_end(const std::vector<std::int64_t>& boxes, int coefficients, cv::Size input) {
  const std::int64_t cells = cells_of(input);
  return !input.empty() && boxes[2] == kDetectionAttributes + coefficients && boxes[1] != cells &&
         boxes[1] != 3 * cells;
}

/// Without a class list: three anchors per cell have an objectness; one has it in YOLOX alone,
/// which is recognized by COCO's classes.
bool looks_like_objectness(const std::vector<std::int64_t>& boxes, cv::Size input) {
  constexpr std::int64_t kCocoWithObjectness = 85;
  if (boxes[1] < boxes[2]) return false;  // only YOLOv8 and later have the attributes first
  const bool coco = boxes[2] == kCocoWithObjectness;
  if (input.empty()) return coco;
  return boxes[1] == 3 * cells_of(input) || (boxes[1] == cells_of(input) && coco);
}

/// Returns the cells of the grids, row by row, by increasing stride.
std::vector<GridCell> grid_cells(cv::Size input) {
  std::vector<GridCell> cells;
  for (const StockAnchors& stock : kStockAnchors) {
    for (int y = 0; y < input.height / stock.stride; ++y) {
      for (int x = 0; x < input.width / stock.stride; ++x) {
        cells.push_back(
            {static_cast<float>(x), static_cast<float>(y), static_cast<float>(stock.stride)});
      }
    }
  }
  return cells;
}

/// A box in the format of the network.
struct CenteredBox {
  float x, y, w, h;
};

/// Ignores boxes that are not finite or have no extent.
void add_candidate(const CenteredBox& b, float confidence, int class_id, std::size_t anchor,
                   std::vector<Candidate>& candidates) {
  if (!std::isfinite(b.x + b.y + b.w + b.h) || b.w <= 0 || b.h <= 0) return;
  candidates.push_back({{b.x - b.w / 2, b.y - b.h / 2, b.w, b.h}, confidence, class_id, anchor});
}

/// Decodes a box of YOLOX (Ge, Liu, Wang, Li and Sun, YOLOX, 2021).
CenteredBox box_in_pixels(const CenteredBox& b, const GridCell& cell) {
  return {(b.x + cell.column) * cell.stride, (b.y + cell.row) * cell.stride,
          std::exp(b.w) * cell.stride, std::exp(b.h) * cell.stride};
}

float logistic(float t) { return 1 / (1 + std::exp(-t)); }

/// @param values  attributes of one anchor: logits of x, y, w, h, objectness, classes
/// @param cell    position in the head: anchor box, row and column
void add_raw_candidate(std::span<const float> values, const RawHead& head, std::size_t cell,
                       std::size_t anchor, float min_confidence,
                       std::vector<Candidate>& candidates) {
  const float objectness = logistic(values[4]);
  if (!(objectness >= min_confidence)) return;  // The score cannot exceed the objectness.
  const auto scores = values.subspan(5);
  const auto top = std::max_element(scores.begin(), scores.end());
  const int class_id = static_cast<int>(top - scores.begin());
  const float confidence = objectness * logistic(*top);
  if (!(confidence >= min_confidence)) return;  // also for NaN
  const auto width = static_cast<std::size_t>(head.width);
  const std::size_t plane = width * static_cast<std::size_t>(head.height);
  const cv::Size2f size = head.sizes[cell / plane];
  const auto row = static_cast<float>(cell % plane / width);
  const auto column = static_cast<float>(cell % width);
  const float w = 2 * logistic(values[2]), h = 2 * logistic(values[3]);
  add_candidate({(2 * logistic(values[0]) - 0.5F + column) * head.stride,
                 (2 * logistic(values[1]) - 0.5F + row) * head.stride, w * w * size.width,
                 h * h * size.height},
                confidence, class_id, anchor, candidates);
}

std::vector<Candidate> candidates_in(std::span<const TensorView> outputs, const YoloShape& shape,
                                     float min_confidence) {
  if (!shape.raw_heads.empty()) return read_raw_candidates(outputs, shape, min_confidence);
  const TensorView& boxes = outputs[shape.boxes_output];
  return shape.end_to_end ? read_detections(boxes, shape, min_confidence)
                          : read_candidates(boxes, shape, min_confidence);
}

Instance to_instance(const Candidate& candidate, const Letterbox& letterbox,
                     const std::vector<std::string>& names, const MaskOfCandidate& mask_of) {
  const cv::Point2f low = letterbox.to_image(candidate.box.tl());
  const cv::Point2f high = letterbox.to_image(candidate.box.br());
  const cv::Rect around(cv::Point(cvFloor(low.x), cvFloor(low.y)),
                        cv::Point(cvCeil(high.x), cvCeil(high.y)));
  Instance instance{.class_id = candidate.class_id,
                    .class_name = names[static_cast<std::size_t>(candidate.class_id)],
                    .confidence = candidate.confidence,
                    .box = around & cv::Rect(cv::Point(), letterbox.image),
                    .mask = {}};
  if (!instance.box.empty()) instance.mask = mask_of(candidate, instance.box);
  return instance;
}

/// Returns whether a box is unusable: outside the image, or with an empty mask.
bool is_void(const Instance& instance) {
  return instance.box.empty() || (!instance.mask.empty() && cv::countNonZero(instance.mask) == 0);
}

}  // namespace

std::vector<Candidate> suppress_overlaps(std::vector<Candidate> candidates, float iou,
                                         std::size_t most) {
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.confidence != b.confidence ? a.confidence > b.confidence : a.anchor < b.anchor;
  });
  std::vector<Candidate> kept;
  for (const Candidate& c : candidates) {
    if (kept.size() >= most) break;
    const bool covered = std::any_of(kept.begin(), kept.end(), [&](const Candidate& k) {
      return k.class_id == c.class_id && intersection_over_union(k.box, c.box) > iou;
    });
    if (!covered) kept.push_back(c);
  }
  return kept;
}

YoloShape recognize_yolo(const std::vector<std::vector<std::int64_t>>& output_shapes,
                         int class_count, const std::string& where, cv::Size input) {
  const auto heads = find_raw_heads(output_shapes, input);
  if (heads.size() == kStockAnchors.size() && !has_boxes(output_shapes)) {
    return raw_shape(output_shapes, heads, class_count, where);
  }
  YoloShape shape = find_outputs(output_shapes, where);
  const auto& boxes = output_shapes[shape.boxes_output];
  const bool known = class_count > 0;
  if (is_end_to_end(boxes, shape.mask_coefficients, input)) {
    if (!known) throw_without_classes(where);
    shape.end_to_end = true;
    shape.attributes_first = false;
    shape.classes = class_count;
    shape.anchors = static_cast<std::size_t>(boxes[1]);
    return shape;
  }
  const std::int64_t plain = 4 + class_count + shape.mask_coefficients;
  const auto has = [&](std::int64_t n) { return boxes[1] == n || boxes[2] == n; };
  if (known && !has(plain) && !has(plain + 1)) throw_wrong_outputs(output_shapes, where);
  shape.objectness = known ? !has(plain) : looks_like_objectness(boxes, input);
  const std::int64_t wanted = shape.objectness ? plain + 1 : plain;
  shape.attributes_first = known ? boxes[1] == wanted : boxes[1] < boxes[2];
  const std::int64_t attributes = shape.attributes_first ? boxes[1] : boxes[2];
  shape.classes = static_cast<int>(attributes - static_cast<std::int64_t>(first_class(shape))) -
                  shape.mask_coefficients;
  shape.anchors = static_cast<std::size_t>(shape.attributes_first ? boxes[2] : boxes[1]);
  if (shape.classes < 1) throw_wrong_outputs(output_shapes, where);
  const bool yolox =
      shape.objectness && !shape.attributes_first && !input.empty() && boxes[1] == cells_of(input);
  if (yolox) shape.cells = grid_cells(input);
  return shape;
}

void leave_decoded(const TensorView& boxes, cv::Size input, YoloShape& shape) {
  float largest = 0;
  for (std::size_t i = 0; i < shape.anchors; ++i) {
    largest = std::max({largest, attribute(boxes, shape, i, 0), attribute(boxes, shape, i, 1)});
  }
  if (largest > static_cast<float>(std::min(input.width, input.height)) / 2) shape.cells.clear();
}

std::vector<Candidate> read_candidates(const TensorView& boxes, const YoloShape& shape,
                                       float min_confidence) {
  const BestClasses best = shape.attributes_first ? best_classes_by_row(boxes, shape)
                                                  : best_classes_by_anchor(boxes, shape);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < shape.anchors; ++i) {
    const float confidence =
        shape.objectness ? best.score[i] * attribute(boxes, shape, i, 4) : best.score[i];
    if (!(confidence >= min_confidence)) continue;  // also for NaN
    CenteredBox box{attribute(boxes, shape, i, 0), attribute(boxes, shape, i, 1),
                    attribute(boxes, shape, i, 2), attribute(boxes, shape, i, 3)};
    if (!shape.cells.empty()) box = box_in_pixels(box, shape.cells[i]);
    add_candidate(box, confidence, best.id[i], i, candidates);
  }
  return candidates;
}

std::vector<Candidate> read_detections(const TensorView& boxes, const YoloShape& shape,
                                       float min_confidence) {
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < shape.anchors; ++i) {
    const float left = attribute(boxes, shape, i, 0), top = attribute(boxes, shape, i, 1);
    const float w = attribute(boxes, shape, i, 2) - left, h = attribute(boxes, shape, i, 3) - top;
    const float confidence = attribute(boxes, shape, i, 4), number = attribute(boxes, shape, i, 5);
    const bool is_class = number >= 0 && number < static_cast<float>(shape.classes);
    if (!(confidence >= min_confidence) || !is_class) continue;  // also for NaN
    add_candidate({left + w / 2, top + h / 2, w, h}, confidence, static_cast<int>(number), i,
                  candidates);
  }
  return candidates;
}

std::vector<Candidate> read_raw_candidates(std::span<const TensorView> outputs,
                                           const YoloShape& shape, float min_confidence) {
  std::vector<Candidate> candidates;
  const std::size_t attributes = attribute_count(shape);
  std::size_t anchor = 0;
  for (const RawHead& head : shape.raw_heads) {
    const auto values = outputs[head.output].values;
    const std::size_t cells = head.sizes.size() * static_cast<std::size_t>(head.height) *
                              static_cast<std::size_t>(head.width);
    for (std::size_t i = 0; i < cells; ++i, ++anchor) {
      add_raw_candidate(values.subspan(i * attributes, attributes), head, i, anchor, min_confidence,
                        candidates);
    }
  }
  return candidates;
}

cv::Mat assemble_mask(const TensorView& prototypes, std::span<const float> coefficients,
                      const Letterbox& letterbox, const cv::Rect& box, float threshold) {
  const cv::Rect window = prototype_window(prototypes, letterbox, box);
  if (window.empty()) return cv::Mat::zeros(box.size(), CV_8UC1);
  const cv::Mat1f logits = weigh_prototypes(prototypes, coefficients, window);
  const float sx =
      static_cast<float>(prototypes.shape[3]) / static_cast<float>(letterbox.input.width);
  const float sy =
      static_cast<float>(prototypes.shape[2]) / static_cast<float>(letterbox.input.height);
  const auto column = [&](int x) {
    const float center = static_cast<float>(box.x + x) + 0.5F;
    return letterbox.to_input({center, 0}).x * sx - 0.5F - static_cast<float>(window.x);
  };
  const auto row = [&](int y) {
    const float center = static_cast<float>(box.y + y) + 0.5F;
    return letterbox.to_input({0, center}).y * sy - 0.5F - static_cast<float>(window.y);
  };
  return above_between(logits, steps_along(box.width, window.width, column),
                       steps_along(box.height, window.height, row), threshold);
}

std::vector<Instance> to_instances(const std::vector<Candidate>& candidates,
                                   const Letterbox& letterbox,
                                   const std::vector<std::string>& class_names,
                                   const MaskOfCandidate& mask_of) {
  std::vector<Instance> instances;
  for (const Candidate& candidate : candidates) {
    Instance instance = to_instance(candidate, letterbox, class_names, mask_of);
    if (!is_void(instance)) instances.push_back(std::move(instance));
  }
  return instances;
}

std::vector<Candidate> decode_candidates(std::span<const TensorView> outputs,
                                         const YoloShape& shape, const DecodeOptions& options) {
  return suppress_overlaps(candidates_in(outputs, shape, options.confidence), options.iou,
                           kMaxInstances);
}

std::vector<Instance> decode_yolo(std::span<const TensorView> outputs, const YoloShape& shape,
                                  const Letterbox& letterbox, const DecodeOptions& options,
                                  const std::vector<std::string>& class_names) {
  const TraceScope scope("decode");
  const auto mask_of = [&](const Candidate& candidate, const cv::Rect& box) {
    if (shape.mask_coefficients == 0) return cv::Mat();
    const auto weights = coefficients_of(outputs[shape.boxes_output], shape, candidate.anchor);
    return assemble_mask(outputs[shape.prototypes_output], weights, letterbox, box);
  };
  return to_instances(decode_candidates(outputs, shape, options), letterbox, class_names, mask_of);
}

}  // namespace stillmap
