// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/segment/letterbox.hpp"

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// A box proposed by a network, before non-maximum suppression.
struct Candidate {
  cv::Rect2f box;          ///< Box in the network's input, edge coordinates [pixels].
  float confidence = 0;    ///< Confidence of the best class [0..1].
  int class_id = 0;        ///< Best class.
  std::size_t anchor = 0;  ///< Index in the network's output.
};

/// Greedy non-maximum suppression within each class: of two boxes of one class whose intersection
/// over union exceeds `iou`, the less confident one is dropped; ties keep the lower anchor.
/// @return at most `most` remaining candidates by descending confidence
std::vector<Candidate> suppress_overlaps(std::vector<Candidate> candidates, float iou,
                                         std::size_t most);

/// One raw head of a YOLOv7 network: [1, 3, height, width, 5 + classes], logits. Its cells are
/// `stride` input pixels wide, and `sizes` are its three anchor boxes.
struct RawHead {
  std::size_t output = 0;  ///< Index of the output.
  int height = 0, width = 0;
  float stride = 0;
  std::array<cv::Size2f, 3> sizes;  ///< Sizes of the anchor boxes in the input [pixels].
};

/// A cell of the grids of a YOLOX network.
struct GridCell {
  float column = 0, row = 0, stride = 0;  ///< Position in its grid; side of the cell [pixels].
};

/// Layout of the outputs of a YOLO network, determined once from their shapes and the class list.
struct YoloShape {
  int classes = 0;
  /// Number of mask coefficients: 32 in standard networks, 0 for detection networks.
  int mask_coefficients = 0;
  /// YOLOv5, YOLOv7 and YOLOX: the box is followed by the objectness, by which the class scores are
  /// multiplied. YOLOv8 and YOLO11 have none.
  bool objectness = false;
  /// End-to-end networks, without non-maximum suppression: each row is a final detection [x1, y1,
  /// x2, y2, confidence, class, mask coefficients].
  bool end_to_end = false;
  /// By increasing stride; empty if the network decodes its boxes itself.
  std::vector<RawHead> raw_heads;
  /// YOLOX, one per anchor: centers are relative to the cell, sizes logarithms, both in strides;
  /// see leave_decoded(). Empty for other networks.
  std::vector<GridCell> cells;
  std::size_t anchors = 0;       ///< Number of anchors of the boxes output; 0 with raw heads.
  bool attributes_first = true;  ///< Order [1, attributes, anchors], else [1, anchors, attributes].
  std::size_t boxes_output = 0, prototypes_output = 1;  ///< Indices of the outputs.
};

/// Recognizes the outputs of YOLO detection and segmentation networks by their shapes:
///
/// - YOLOv8 and YOLO11: one output of 3 dimensions with 4 box coordinates, class scores and mask
///   coefficients per anchor, in either order, and (segmentation) one of 4 dimensions with the mask
///   prototypes [1, coefficients, height, width];
/// - YOLOv7 (and v5) exported with its grid: the same with the objectness after the box,
///   5 + classes + coefficients per anchor, normally [1, anchors, 85]; additional raw heads are
///   ignored;
/// - YOLOX: one output [1, anchors, 5 + classes] with one anchor per cell of the input's grids;
/// - YOLOv7 exported without its grid: three outputs [1, 3, height, width, 5 + classes], logits,
///   decoded with the standard anchor boxes (cfg/training/yolov7.yaml). Networks with other
///   anchors, such as YOLOv7-tiny, must be exported with their grid;
/// - YOLOv10, YOLO26 and exports with `nms=True`: one output [1, detections, 6 + coefficients]. A
///   network with anchors and one or two classes has as many attributes, but another number of
///   rows: one or three per cell of the input's grids.
///
/// @param class_count  from the metadata; 0 if unknown: then the shorter axis contains the
/// attributes, and there is an objectness if there are three anchors per cell of the input's grids
/// (strides 8, 16 and 32), one per cell and 85 attributes (YOLOX), or, with an empty `input`, if an
/// anchor has 85 consecutive attributes
/// @param input        size of the network's input [pixels]; needed for raw heads and end-to-end
/// networks; the latter also need the class count
/// Throws Error (naming `where`) for other shapes.
YoloShape recognize_yolo(const std::vector<std::vector<std::int64_t>>& output_shapes,
                         int class_count, const std::string& where, cv::Size input = {});

/// Clears `shape.cells` if the boxes of a YOLOX network are in pixels already (an export with
/// --decode_in_inference): the centers then spread over the input.
void leave_decoded(const TensorView& boxes, cv::Size input, YoloShape& shape);

/// Thresholds of the decoder.
struct DecodeOptions {
  float confidence = 0.25F;  ///< Minimum confidence of a candidate [0..1].
  float iou = 0.7F;          ///< See suppress_overlaps().
};

/// Returns the candidates with at least `min_confidence` [0..1], in anchor order. The confidence is
/// the score of the best class, times the objectness if there is one.
std::vector<Candidate> read_candidates(const TensorView& boxes, const YoloShape& shape,
                                       float min_confidence);

/// The same for end-to-end networks. Detections of classes that the network does not have are
/// ignored.
std::vector<Candidate> read_detections(const TensorView& boxes, const YoloShape& shape,
                                       float min_confidence);

/// The same for raw heads (Wang, Bochkovskiy and Liao, YOLOv7, CVPR 2023, with the box equations of
/// YOLOv5): with the logistic function s, the cell (i, j) and the anchor box (a, b),
///
///     x = (2 s(t_x) - 0.5 + j) * stride, y likewise with i
///     w = (2 s(t_w))^2 * a, h likewise with b
///
/// Anchors are numbered by head, anchor box, row and column.
std::vector<Candidate> read_raw_candidates(std::span<const TensorView> outputs,
                                           const YoloShape& shape, float min_confidence);

/// Returns the mask of one candidate inside `box` (pixels of the full image): the prototypes
/// weighted by the candidate's coefficients, interpolated bilinearly, 255 where the sum is above
/// `threshold` (0 for logits: sigmoid above one half). 8UC1 of the box's size.
cv::Mat assemble_mask(const TensorView& prototypes, std::span<const float> coefficients,
                      const Letterbox& letterbox, const cv::Rect& box, float threshold = 0);

/// Returns the mask of a candidate inside a box (pixels of the full image); empty if it has none.
using MaskOfCandidate = std::function<cv::Mat(const Candidate&, const cv::Rect&)>;

/// Returns the candidates as instances in image pixels, their boxes widened to whole pixels. Those
/// outside the image or with an empty mask are left out.
std::vector<Instance> to_instances(const std::vector<Candidate>& candidates,
                                   const Letterbox& letterbox,
                                   const std::vector<std::string>& class_names,
                                   const MaskOfCandidate& mask_of);

/// Maximum number of instances per frame: the most confident ones.
inline constexpr std::size_t kMaxInstances = 100;

/// Returns the candidates that are confident enough and that non-maximum suppression keeps, by
/// descending confidence: at most 100.
std::vector<Candidate> decode_candidates(std::span<const TensorView> outputs,
                                         const YoloShape& shape, const DecodeOptions& options);

/// Decodes the outputs of a network to instances in image pixels, by descending confidence: at most
/// 100. The boxes of decode_candidates() are widened to whole pixels.
std::vector<Instance> decode_yolo(std::span<const TensorView> outputs, const YoloShape& shape,
                                  const Letterbox& letterbox, const DecodeOptions& options,
                                  const std::vector<std::string>& class_names);

}  // namespace stillmap
