// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/yolo_decoder.hpp"

#include "stillmap/base/error.hpp"

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

/// Attribute `a` of anchor `i`.
float attribute(const TensorView& boxes, const YoloShape& shape, std::size_t i, std::size_t a) {
  const auto count = static_cast<std::size_t>(4 + shape.classes + shape.mask_coefficients);
  return boxes.values[shape.attributes_first ? a * shape.anchors + i : i * count + a];
}

/// The best score of each anchor, and its class.
struct BestClasses {
  std::vector<float> score;
  std::vector<int> id;
};

BestClasses best_classes_by_row(const TensorView& boxes, const YoloShape& shape) {
  BestClasses best{std::vector<float>(shape.anchors, 0.0F), std::vector<int>(shape.anchors, 0)};
  for (int c = 0; c < shape.classes; ++c) {
    const float* row = boxes.values.data() + (4 + static_cast<std::size_t>(c)) * shape.anchors;
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
  const auto count = static_cast<std::size_t>(4 + shape.classes + shape.mask_coefficients);
  for (std::size_t i = 0; i < shape.anchors; ++i) {
    const auto scores =
        boxes.values.subspan(i * count + 4, static_cast<std::size_t>(shape.classes));
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
    coefficients[k] =
        attribute(boxes, shape, anchor, 4 + static_cast<std::size_t>(shape.classes) + k);
  }
  return coefficients;
}

/// The part of the prototypes that a box touches, with one pixel around it for the interpolation.
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

/// Weighted sum of the prototypes within the window: the logits of the mask.
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

/// For each pixel of a stretch of the image: between which two samples it lies, and how far from
/// the first.
struct Steps {
  std::vector<int> first, second;
  std::vector<float> weight;  // of the second
};

/// @param position of the pixel's centre among the samples (sample centres at integers)
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

/// 255 where the bilinear interpolation of the samples is positive.
cv::Mat positive_between(const cv::Mat1f& samples, const Steps& columns, const Steps& rows) {
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
      out[x] = l + columns.weight[x] * (r - l) > 0 ? 255 : 0;
    }
  }
  return mask;
}

[[noreturn]] void throw_wrong_outputs(const std::vector<std::vector<std::int64_t>>& shapes,
                                      const std::string& where) {
  std::string list;
  for (const auto& shape : shapes) list += fmt::format(" [{}]", fmt::join(shape, ", "));
  throw Error("these are not the outputs of a YOLOv8 or YOLO11 detect or segment network:" + list,
              where, export_advice());
}

bool all_positive(const std::vector<std::int64_t>& shape) {
  return std::all_of(shape.begin(), shape.end(), [](std::int64_t n) { return n > 0; });
}

/// Which outputs hold the boxes and, for segment networks, the prototypes.
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
    shape.prototype_height = static_cast<int>(shapes[*prototypes][2]);
    shape.prototype_width = static_cast<int>(shapes[*prototypes][3]);
  }
  return shape;
}

Instance to_instance(const Candidate& candidate, std::span<const TensorView> outputs,
                     const YoloShape& shape, const Letterbox& letterbox,
                     const std::vector<std::string>& names) {
  const cv::Point2f low = letterbox.to_image(candidate.box.tl());
  const cv::Point2f high = letterbox.to_image(candidate.box.br());
  const cv::Rect around(cv::Point(cvFloor(low.x), cvFloor(low.y)),
                        cv::Point(cvCeil(high.x), cvCeil(high.y)));
  Instance instance{.class_id = candidate.class_id,
                    .class_name = names[static_cast<std::size_t>(candidate.class_id)],
                    .confidence = candidate.confidence,
                    .box = around & cv::Rect(cv::Point(), letterbox.image),
                    .mask = {}};
  if (shape.mask_coefficients > 0 && !instance.box.empty()) {
    const auto weights = coefficients_of(outputs[shape.boxes_output], shape, candidate.anchor);
    instance.mask =
        assemble_mask(outputs[shape.prototypes_output], weights, letterbox, instance.box);
  }
  return instance;
}

/// A box that leaves nothing to act on: outside of the image, or with a mask that is empty.
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

YoloShape recognise_yolo(const std::vector<std::vector<std::int64_t>>& output_shapes,
                         int class_count, const std::string& where) {
  YoloShape shape = find_outputs(output_shapes, where);
  const auto& boxes = output_shapes[shape.boxes_output];
  const std::int64_t known = class_count > 0 ? 4 + class_count + shape.mask_coefficients : 0;
  shape.attributes_first = known > 0 ? boxes[1] == known : boxes[1] < boxes[2];
  const std::int64_t attributes = shape.attributes_first ? boxes[1] : boxes[2];
  shape.classes = static_cast<int>(attributes) - 4 - shape.mask_coefficients;
  shape.anchors = static_cast<std::size_t>(shape.attributes_first ? boxes[2] : boxes[1]);
  if (shape.classes < 1 || (known > 0 && attributes != known)) {
    throw_wrong_outputs(output_shapes, where);
  }
  return shape;
}

std::vector<Candidate> read_candidates(const TensorView& boxes, const YoloShape& shape,
                                       const DecodeOptions& options) {
  const BestClasses best = shape.attributes_first ? best_classes_by_row(boxes, shape)
                                                  : best_classes_by_anchor(boxes, shape);
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < shape.anchors; ++i) {
    if (!(best.score[i] >= options.confidence)) continue;
    if (!options.wanted.empty() && !options.wanted[static_cast<std::size_t>(best.id[i])]) continue;
    const float x = attribute(boxes, shape, i, 0), y = attribute(boxes, shape, i, 1);
    const float w = attribute(boxes, shape, i, 2), h = attribute(boxes, shape, i, 3);
    if (!std::isfinite(x + y + w + h) || w <= 0 || h <= 0) continue;
    candidates.push_back({{x - w / 2, y - h / 2, w, h}, best.score[i], best.id[i], i});
  }
  return candidates;
}

cv::Mat assemble_mask(const TensorView& prototypes, std::span<const float> coefficients,
                      const Letterbox& letterbox, const cv::Rect& box) {
  const cv::Rect window = prototype_window(prototypes, letterbox, box);
  if (window.empty()) return cv::Mat::zeros(box.size(), CV_8UC1);
  const cv::Mat1f logits = weigh_prototypes(prototypes, coefficients, window);
  const float sx =
      static_cast<float>(prototypes.shape[3]) / static_cast<float>(letterbox.input.width);
  const float sy =
      static_cast<float>(prototypes.shape[2]) / static_cast<float>(letterbox.input.height);
  const auto column = [&](int x) {
    const float centre = static_cast<float>(box.x + x) + 0.5F;
    return letterbox.to_input({centre, 0}).x * sx - 0.5F - static_cast<float>(window.x);
  };
  const auto row = [&](int y) {
    const float centre = static_cast<float>(box.y + y) + 0.5F;
    return letterbox.to_input({0, centre}).y * sy - 0.5F - static_cast<float>(window.y);
  };
  return positive_between(logits, steps_along(box.width, window.width, column),
                          steps_along(box.height, window.height, row));
}

std::vector<Instance> decode_yolo(std::span<const TensorView> outputs, const YoloShape& shape,
                                  const Letterbox& letterbox, const DecodeOptions& options,
                                  const std::vector<std::string>& class_names) {
  const auto kept = suppress_overlaps(read_candidates(outputs[shape.boxes_output], shape, options),
                                      options.iou, options.max_instances);
  std::vector<Instance> instances;
  for (const Candidate& candidate : kept) {
    Instance instance = to_instance(candidate, outputs, shape, letterbox, class_names);
    if (!is_void(instance)) instances.push_back(std::move(instance));
  }
  return instances;
}

}  // namespace stillmap
