// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/network.hpp"

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

/// Checks that input and outputs hold 32-bit floats; class numbers may be integers.
void check_types(const OnnxInfo& info, const std::string& file) {
  for (const auto* values : {&info.inputs, &info.outputs}) {
    for (const OnnxValue& value : *values) {
      if (value.element_type == OnnxValue::kFloat) continue;
      const bool is_output = values == &info.outputs;
      if (is_output && value.name == kLabels && value.element_type == OnnxValue::kInt64) continue;
      throw Error(
          fmt::format("the network's {} \"{}\" holds {}, not 32-bit floats",
                      is_output ? "output" : "input", value.name,
                      value.element_type == OnnxValue::kHalf ? "16-bit floats" : "integers"),
          file,
          export_advice() +
              " (without half=True); scripts/quantize_network.py --half then "
              "converts it to 16-bit floats inside");
    }
  }
}

/// Returns whether the input is an image with its channels last.
bool has_channels_last(const std::vector<std::int64_t>& shape) {
  return shape.size() == 4 && shape[3] == 3 && shape[1] != 3;
}

/// Returns the input's shape with dynamic sizes filled in; throws Error if it is not an image.
std::array<int, 4> input_shape_of(const OnnxInfo& info, const std::string& file) {
  const auto& shape = info.inputs.front().shape;
  const bool last = has_channels_last(shape);
  const auto fits = [](std::int64_t n, std::int64_t wanted) { return n == wanted || n == -1; };
  if (info.inputs.size() != 1 || shape.size() != 4 || !fits(shape[0], 1) ||
      !fits(shape[last ? 3 : 1], 3)) {
    throw Error(fmt::format("the network's input is [{}], not one image [1, 3, height, width]",
                            fmt::join(shape, ", ")),
                file, export_advice());
  }
  constexpr std::int64_t kLargest = 8192;
  const auto size_at = [&](std::size_t i, int dynamic) {
    return shape[i] > 0 ? shape[i] : dynamic;
  };
  const auto height = size_at(last ? 1 : 2, kDynamicHeight);
  const auto width = size_at(last ? 2 : 3, kDynamicWidth);
  if (height > kLargest || width > kLargest) {
    throw Error(fmt::format("an input of {} x {} pixels is too large", width, height), file,
                export_advice());
  }
  const int h = static_cast<int>(height), w = static_cast<int>(width);
  return last ? std::array<int, 4>{1, h, w, 3} : std::array<int, 4>{1, 3, h, w};
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

std::vector<std::string> names_of(const std::vector<OnnxValue>& values) {
  std::vector<std::string> names;
  for (const auto& value : values) names.push_back(value.name);
  return names;
}

std::vector<std::string> names_from(const OnnxInfo& info) {
  std::vector<std::string> names = class_names_in(info.metadata);
  std::transform(names.begin(), names.end(), names.begin(), coco_class_name);
  return names;
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

Network::Network(const SegmentOptions& options) : options_(options) {
  const OnnxInfo info = read_onnx(options.model);
  check_task(info, options.model);
  const auto shape = input_shape_of(info, options.model);
  check_types(info, options.model);
  channels_last_ = has_channels_last(info.inputs.front().shape);
  output_names_ = names_of(info.outputs);
  class_names_ = names_from(info);
  engine_ = choose_engine(options.backend,
                          {.model = options.model,
                           .input = info.inputs.front().name,
                           .input_shape = shape,
                           .dynamic_dimensions = dynamic_dimensions(info.inputs.front(), shape),
                           .outputs = output_names_,
                           .device = options.device,
                           .threads = options.threads});
  run_once();
}

void Network::run_once() {
  try {
    std::ranges::fill(engine_.engine->input(), 0.0F);
    outputs_ = engine_.engine->run();
    check_numbers(outputs_, options_.model);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& e) {
    throw Error("the network loads but does not run: " + cause_in(e.what()), options_.model,
                export_advice());
  }
}

cv::Size Network::input_size() const {
  const auto shape = engine_.engine->input_shape();
  return channels_last_ ? cv::Size(shape[2], shape[1]) : cv::Size(shape[3], shape[2]);
}

std::vector<std::vector<std::int64_t>> Network::output_shapes() const {
  std::vector<std::vector<std::int64_t>> shapes;
  for (const auto& output : outputs_) shapes.push_back(output.shape);
  return shapes;
}

const std::vector<TensorView>& Network::run_on(const cv::Mat& color, const Letterbox& letterbox,
                                               const PixelFormat& format) {
  check_color(color);
  letterbox.fill(color, engine_.engine->input(), format);
  outputs_ = traced("inference", [&] { return engine_.engine->run(); });
  return outputs_;
}

InferenceInfo Network::inference() const {
  const EngineName name = engine_.engine->name();
  return {name.library, name.version, engine_.device};
}

std::string Network::description(const std::string& kind, std::size_t classes) const {
  const cv::Size size = input_size();
  std::string text = fmt::format(
      "{} ({}, {}), {} x {}, {}", std::filesystem::path(options_.model).filename().string(), kind,
      counted(classes, "class"), size.width, size.height, engine_.engine->name().text());
  if (engine_.device == "cpu") text += ", " + counted(options_.threads, "thread");
  return engine_.reason.empty() ? text : text + "; faster devices: " + engine_.reason;
}

}  // namespace stillmap
