// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/segment/letterbox.hpp"

#include <array>
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

/// One raw head of a YOLOv7 network: [1, 3, height, width, 5 + classes], logits. Its cells are
/// `stride` pixels of the input wide, and `sizes` are its three anchor boxes.
struct RawHead {
  std::size_t output = 0;  ///< which output it is
  int height = 0, width = 0;
  float stride = 0;
  std::array<cv::Size2f, 3> sizes;  ///< pixels of the input
};

/// How the outputs of one YOLO network are to be read: fixed by their shapes and the class list,
/// once.
struct YoloShape {
  int classes = 0;
  int mask_coefficients = 0;  ///< 32 in stock networks; 0 for networks that only detect
  /// YOLOv5 and YOLOv7: after the box comes the probability that there is anything at all, which
  /// the class scores are to be multiplied with. YOLOv8 and YOLO11 have none.
  bool objectness = false;
  std::vector<RawHead> raw_heads;  ///< by rising stride; empty where the network decodes by itself
  std::size_t anchors = 0;         ///< of the boxes output; 0 with raw heads
  bool attributes_first = true;    ///< [1, attributes, anchors], else [1, anchors, attributes]
  int prototype_height = 0, prototype_width = 0;
  std::size_t boxes_output = 0, prototypes_output = 1;  ///< which output is which
};

/// Recognizes the outputs of YOLO detect and segment networks, by their shapes:
///
/// - YOLOv8 and YOLO11: one output of 3 dimensions with 4 box coordinates, the class scores and the
///   mask coefficients per anchor, in either order, and (segment) one of 4 dimensions with the mask
///   prototypes [1, coefficients, height, width];
/// - YOLOv7 (and v5) exported with its grid: the same with the objectness after the box, 5 +
/// classes
///   + coefficients per anchor, normally [1, anchors, 85]; raw heads that come beside it are not
///   needed;
/// - YOLOv7 exported without: three outputs [1, 3, height, width, 5 + classes], logits, read with
///   the anchor boxes of the stock network (its cfg/training/yolov7.yaml). Networks with other
///   anchors, such as YOLOv7-tiny, are to be exported with their grid.
///
/// @param class_count from the metadata; 0 where unknown: then the shorter axis holds the
/// attributes, and there is an objectness where there are three anchors to each cell of the input's
/// grids (strides 8, 16 and 32), or, `input` being empty, where an anchor has 85 attributes in
/// succession
/// @param input size of the network's input, pixels; needed for raw heads
/// Throws Error (naming `where`) if the shapes are those of no such network.
YoloShape recognize_yolo(const std::vector<std::vector<std::int64_t>>& output_shapes,
                         int class_count, const std::string& where, cv::Size input = {});

/// Thresholds of the decoder.
struct DecodeOptions {
  float confidence = 0.25F;         ///< candidates below are dropped
  float iou = 0.7F;                 ///< see suppress_overlaps
  std::size_t max_instances = 100;  ///< per frame
  std::vector<bool> wanted;         ///< by class id; empty for all
};

/// Candidates above the threshold whose best class is wanted, in the order of their anchors. The
/// confidence is the best class's score, times the objectness where there is one.
std::vector<Candidate> read_candidates(const TensorView& boxes, const YoloShape& shape,
                                       const DecodeOptions& options);

/// The same for raw heads (Wang, Bochkovskiy and Liao, YOLOv7, CVPR 2023, with the box equations of
/// YOLOv5): with s the logistic function, the cell (i, j), and the anchor box (a, b),
///
///     x = (2 s(t_x) - 0.5 + j) * stride, y likewise with i; w = (2 s(t_w))^2 * a, h likewise with
///     b
///
/// Anchors are numbered head by head, then by anchor box, row and column.
std::vector<Candidate> read_raw_candidates(std::span<const TensorView> outputs,
                                           const YoloShape& shape, const DecodeOptions& options);

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
