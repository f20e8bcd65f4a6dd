// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/segment/letterbox.hpp"

#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A box that a network proposes, before non-maximum suppression.
struct Candidate {
  cv::Rect2f box;          ///< pixels of the network's input, edges
  float confidence = 0;    ///< of its best class
  int class_id = 0;        ///< its best class
  std::size_t anchor = 0;  ///< its place in the network's output
};

/// Greedy non-maximum suppression within each class: of two boxes of one class whose intersection
/// over union exceeds `iou`, the less confident one goes. Equal confidences: the lower anchor wins.
/// @return the survivors, at most `most`, by falling confidence
std::vector<Candidate> suppress_overlaps(std::vector<Candidate> candidates, float iou,
                                         std::size_t most);

/// How the outputs of one YOLO network are to be read: fixed by their shapes and the class list,
/// once.
struct YoloShape {
  int classes = 0;
  int mask_coefficients = 0;  ///< 32 in stock networks; 0 for networks that only detect
  std::size_t anchors = 0;
  bool attributes_first = true;  ///< [1, attributes, anchors], else [1, anchors, attributes]
  int prototype_height = 0, prototype_width = 0;
  std::size_t boxes_output = 0, prototypes_output = 1;  ///< which output is which
};

/// Recognises the outputs of YOLOv8 and YOLO11 detect and segment networks: one of 3 dimensions
/// with 4 box coordinates, the class scores and the mask coefficients per anchor, in either order,
/// and (segment) one of 4 dimensions with the mask prototypes [1, coefficients, height, width].
/// @param class_count from the metadata; 0 where unknown: then the shorter axis holds the
/// attributes Throws Error (naming `where`) if the shapes are those of no such network.
YoloShape recognise_yolo(const std::vector<std::vector<std::int64_t>>& output_shapes,
                         int class_count, const std::string& where);

/// Thresholds of the decoder.
struct DecodeOptions {
  float confidence = 0.25F;         ///< candidates below are dropped
  float iou = 0.7F;                 ///< see suppress_overlaps
  std::size_t max_instances = 100;  ///< per frame
  std::vector<bool> wanted;         ///< by class id; empty for all
};

/// Candidates above the threshold whose best class is wanted, in the order of their anchors.
std::vector<Candidate> read_candidates(const TensorView& boxes, const YoloShape& shape,
                                       const DecodeOptions& options);

/// The mask of one candidate inside `box` (pixels of the full image): the prototypes weighted by
/// the candidate's coefficients, bilinear between prototype pixels, 255 where the sum is positive
/// (that is where its sigmoid exceeds one half). 8UC1 of the box's size.
cv::Mat assemble_mask(const TensorView& prototypes, std::span<const float> coefficients,
                      const Letterbox& letterbox, const cv::Rect& box);

/// All of it: outputs of a network to instances in the pixels of the image, by falling confidence.
std::vector<Instance> decode_yolo(std::span<const TensorView> outputs, const YoloShape& shape,
                                  const Letterbox& letterbox, const DecodeOptions& options,
                                  const std::vector<std::string>& class_names);

}  // namespace stillmap
