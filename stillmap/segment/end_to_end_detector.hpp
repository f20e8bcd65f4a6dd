// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/network_detector.hpp"
#include "stillmap/segment/yolo_decoder.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Outputs of an end-to-end network with the names `dets`, `labels` and `masks`. Its detections
/// need no non-maximum suppression.
///
/// **RF-DETR** (github.com/roboflow/rf-detr, docs/exports/onnx.md and issue 401): `dets` [1,
/// queries, 4] is center x, center y, width and height of the boxes, relative to the input's size;
/// `labels` [1, queries, columns] are logits of the classes, each with its own sigmoid; `masks` [1,
/// queries, height, width] are logits for the whole image. The input is RGB with ImageNet's mean
/// and standard deviation; the image fills it with another aspect ratio.
///
/// **RTMDet and RTMDet-Ins** by MMDeploy (github.com/open-mmlab/mmdeploy, configs/mmdet and
/// mmdeploy/codebase/mmdet/models/dense_heads/rtmdet_ins_head.py): `dets` [1, detections, 5] is x1,
/// y1, x2, y2 in input pixels and the score [0..1]; `labels` [1, detections] are class numbers;
/// `masks` [1, detections, height, width] are probabilities. Without detections there is one row of
/// zeros, for which there may be no mask. The input (github.com/open-mmlab/mmdetection,
/// configs/rtmdet/rtmdet_l_8xb32-300e_coco.py) is BGR with ImageNet's mean and standard deviation;
/// the image is in its upper left corner, the rest is gray (114).
struct EndToEndShape {
  bool queries = false;  ///< RF-DETR; RTMDet otherwise.
  std::size_t dets = 0, labels = 0;
  std::optional<std::size_t> masks;
};

/// Finds the outputs by their names. Throws Error (naming `where`) if their shapes fit neither
/// RF-DETR nor RTMDet.
EndToEndShape recognize_end_to_end(const std::vector<std::string>& names,
                                   const std::vector<std::vector<std::int64_t>>& shapes,
                                   const std::string& where);

/// Returns the class names by the columns of RF-DETR's labels. A network has as many classes as
/// columns, or one less: then the last column is the background. Without names, 91 columns are the
/// category ids of COCO, as in the published weights. Throws Error (naming `where`) otherwise.
std::vector<std::string> names_of_columns(std::vector<std::string> names, std::size_t columns,
                                          const std::string& where);

/// Decodes the outputs to instances in image pixels, by descending confidence: at most 100 with at
/// least `min_confidence` [0..1].
std::vector<Instance> decode_end_to_end(std::span<const TensorView> outputs,
                                        const EndToEndShape& shape, const Letterbox& letterbox,
                                        float min_confidence,
                                        const std::vector<std::string>& class_names);

/// An RF-DETR, RTMDet or RTMDet-Ins network. Class names are read from the metadata; without them,
/// they are COCO's.
class EndToEndDetector final : public NetworkDetector {
 public:
  /// Returns whether there are outputs `dets` and `labels`.
  static bool fits(const Network& network);
  /// Throws Error if the outputs or the number of classes do not fit such a network.
  explicit EndToEndDetector(Network network);

  std::vector<Instance> detect(const RgbdFrame& frame) override;
  bool gives_masks() const override { return shape_.masks.has_value(); }

 private:
  EndToEndShape shape_;
};

}  // namespace stillmap
