// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/yolo_detector.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/segment/coco.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

namespace stillmap {
namespace {

// Input size for networks with dynamic size [pixels].
constexpr int kDynamicHeight = 480, kDynamicWidth = 640;

/// Checks that input and outputs hold 32-bit floats.
void check_types(const OnnxInfo& info, const std::string& file) {
  for (const auto* values : {&info.inputs, &info.outputs}) {
    for (const OnnxValue& value : *values) {
      if (value.element_type == OnnxValue::kFloat) continue;
      throw Error(
          fmt::format("the network's {} \"{}\" holds {}, not 32-bit floats",
                      values == &info.inputs ? "input" : "output", value.name,
                      value.element_type == OnnxValue::kHalf ? "16-bit floats" : "integers"),
          file,
          export_advice() +
              " (without half=True); scripts/quantize_network.py --half then "
              "converts it to 16-bit floats inside");
    }
  }
}

/// Returns 1 x 3 x height x width with dynamic sizes filled in; throws Error if the input is not an
/// image.
std::array<int, 4> input_shape_of(const OnnxInfo& info, const std::string& file) {
  const auto& shape = info.inputs.front().shape;
  const auto fits = [](std::int64_t n, std::int64_t wanted) { return n == wanted || n == -1; };
  if (info.inputs.size() != 1 || shape.size() != 4 || !fits(shape[0], 1) || !fits(shape[1], 3)) {
    throw Error(fmt::format("the network's input is [{}], not one image [1, 3, height, width]",
                            fmt::join(shape, ", ")),
                file, export_advice());
  }
  constexpr std::int64_t kLargest = 8192;
  const auto height = shape[2] > 0 ? shape[2] : kDynamicHeight;
  const auto width = shape[3] > 0 ? shape[3] : kDynamicWidth;
  if (height > kLargest || width > kLargest) {
    throw Error(fmt::format("an input of {} x {} pixels is too large", width, height), file,
                export_advice());
  }
  return {1, 3, static_cast<int>(height), static_cast<int>(width)};
}

/// Returns the sizes of the named dynamic dimensions; a name with two sizes is left out.
std::map<std::string, int> dynamic_dimensions(const OnnxValue& input,
                                              const std::array<int, 4>& shape) {
  std::map<std::string, int> sizes;
  std::set<std::string> ambiguous = {""};
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const auto [known, added] = sizes.emplace(input.names[i], shape[i]);
    if (!added && known->second != shape[i]) ambiguous.insert(known->first);
  }
  for (const std::string& name : ambiguous) sizes.erase(name);
  return sizes;
}

std::vector<std::string> output_names(const OnnxInfo& info) {
  std::vector<std::string> names;
  for (const auto& output : info.outputs) names.push_back(output.name);
  return names;
}

std::vector<std::string> names_from(const OnnxInfo& info) {
  const auto found = info.metadata.find("names");
  if (found == info.metadata.end()) return {};
  std::vector<std::string> names = parse_class_names(found->second);
  std::transform(names.begin(), names.end(), names.begin(), coco_class_name);
  return names;
}

std::vector<std::string> numbered_names(int classes) {
  std::vector<std::string> names;
  for (int c = 0; c < classes; ++c) names.push_back("class " + std::to_string(c));
  return names;
}

std::vector<std::vector<std::int64_t>> shapes_of(const std::vector<TensorView>& outputs) {
  std::vector<std::vector<std::int64_t>> shapes;
  for (const auto& output : outputs) shapes.push_back(output.shape);
  return shapes;
}

/// Checks the outputs for a black image: a damaged network, or one whose values exceed the range of
/// 16-bit floats, would find nothing in any image.
void check_numbers(const std::vector<TensorView>& outputs, const std::string& file) {
  for (const TensorView& output : outputs) {
    if (std::ranges::all_of(output.values, [](float v) { return std::isfinite(v); })) continue;
    throw Error("the network computes infinite values or none (NaN)", file,
                "the file may be damaged: " + export_advice() +
                    "; if it holds 16-bit floats, take the one with 32-bit floats");
  }
}

/// Checks the task in the metadata of Ultralytics networks; only detection and segmentation fit.
void check_task(const OnnxInfo& info, const std::string& file) {
  const auto task = info.metadata.find("task");
  if (task == info.metadata.end() || task->second == "detect" || task->second == "segment") return;
  throw Error(
      fmt::format("this network was made for {}, not for detection or segmentation", task->second),
      file, export_advice());
}

void check_color(const cv::Mat& color) {
  if (!color.empty() && color.type() == CV_8UC3) return;
  throw Error("a detector needs a color image of three bytes per pixel", "frame", "");
}

}  // namespace

YoloDetector::YoloDetector(const SegmentOptions& options) : options_(options) {
  const OnnxInfo info = read_onnx(options.model);
  check_task(info, options.model);
  const auto shape = input_shape_of(info, options.model);
  check_types(info, options.model);
  engine_ = choose_engine(options.backend,
                          {.model = options.model,
                           .input = info.inputs.front().name,
                           .input_shape = shape,
                           .dynamic_dimensions = dynamic_dimensions(info.inputs.front(), shape),
                           .outputs = output_names(info),
                           .device = options.device,
                           .threads = options.threads});
  check_outputs(info);
  decode_ = {.confidence = options.confidence, .iou = options.iou};
}

/// Uses the shapes of a real run, since back ends and dynamic files differ from the declared ones.
void YoloDetector::check_outputs(const OnnxInfo& info) {
  class_names_ = names_from(info);
  std::vector<std::vector<std::int64_t>> shapes;
  try {
    std::ranges::fill(engine_.engine->input(), 0.0F);
    const std::vector<TensorView> outputs = engine_.engine->run();
    check_numbers(outputs, options_.model);
    shapes = shapes_of(outputs);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error("the network loads but does not run: " + cause_in(e.what()), options_.model,
                export_advice());
  }
  shape_ =
      recognize_yolo(shapes, static_cast<int>(class_names_.size()), options_.model, input_size());
  if (class_names_.empty()) {
    class_names_ = shape_.classes == 80 ? coco_class_names() : numbered_names(shape_.classes);
  }
}

cv::Size YoloDetector::input_size() const {
  const auto shape = engine_.engine->input_shape();
  return {shape[3], shape[2]};
}

std::vector<TensorView> YoloDetector::run_on(const cv::Mat& color, const Letterbox& letterbox) {
  letterbox.fill(color, engine_.engine->input());
  return traced("inference", [&] { return engine_.engine->run(); });
}

std::vector<Candidate> YoloDetector::detect_candidates(const cv::Mat& color) {
  check_color(color);
  const Letterbox letterbox(color.size(), input_size());
  return decode_candidates(run_on(color, letterbox), shape_, decode_);
}

std::vector<Instance> YoloDetector::detect(const RgbdFrame& frame) {
  check_color(frame.color);
  const Letterbox letterbox(frame.color.size(), input_size());
  return decode_yolo(run_on(frame.color, letterbox), shape_, letterbox, decode_, class_names_);
}

std::optional<InferenceInfo> YoloDetector::inference() const {
  const EngineName name = engine_.engine->name();
  return InferenceInfo{name.library, name.version, engine_.device};
}

std::string YoloDetector::description() const {
  const cv::Size size = input_size();
  std::string text = fmt::format(
      "{} ({}, {}), {} x {}, {}", std::filesystem::path(options_.model).filename().string(),
      segments() ? "masks" : "boxes", counted(class_names_.size(), "class"), size.width,
      size.height, engine_.engine->name().text());
  if (engine_.device == "cpu") text += ", " + counted(options_.threads, "thread");
  return engine_.reason.empty() ? text : text + "; faster devices: " + engine_.reason;
}

}  // namespace stillmap
