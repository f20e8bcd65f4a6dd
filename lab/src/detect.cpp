// SPDX-License-Identifier: Apache-2.0
/// Detections of a network as CSV, one line each: image, class, confidence, and the corners of the
/// box before it is widened to whole pixels [image pixels, edge coordinates]. With --repeat the
/// median time of letterbox, network and decoder is printed to standard error.
#include "stillmap/base/error.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/segment/yolo_detector.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

struct DetectArguments {
  std::vector<std::string> images;
  SegmentOptions network;
  int repeat = 1;
};

cv::Mat read_color(const std::string& file) {
  const cv::Mat image = read_stored_image(file).image;
  if (image.empty()) throw Error("this is not a readable image", file, "give a PNG or JPEG file");
  return image;
}

void print_detections(const std::string& file, const cv::Mat& image, const YoloDetector& detector,
                      const std::vector<Candidate>& candidates) {
  const Letterbox letterbox(image.size(), detector.input_size());
  for (const Candidate& c : candidates) {
    const cv::Point2f low = letterbox.to_image(c.box.tl()), high = letterbox.to_image(c.box.br());
    const std::string& name = detector.class_names()[static_cast<std::size_t>(c.class_id)];
    fmt::print("{},{},{:.6f},{:.5f},{:.5f},{:.5f},{:.5f}\n", file, name, c.confidence, low.x, low.y,
               high.x, high.y);
  }
}

void detect(const DetectArguments& arguments) {
  YoloDetector detector(arguments.network);
  fmt::print("image,class,confidence,x0,y0,x1,y1\n");
  std::vector<double> milliseconds;
  for (const std::string& file : arguments.images) {
    const cv::Mat image = read_color(file);
    for (int i = 1; i < arguments.repeat; ++i) {
      const Stopwatch stopwatch;
      detector.detect_candidates(image);
      milliseconds.push_back(stopwatch.milliseconds());
    }
    print_detections(file, image, detector, detector.detect_candidates(image));
  }
  if (milliseconds.empty()) return;
  const auto middle = milliseconds.begin() + static_cast<std::ptrdiff_t>(milliseconds.size() / 2);
  std::nth_element(milliseconds.begin(), middle, milliseconds.end());
  fmt::print(stderr, "{}: median {:.1f} ms per image\n", detector.description(), *middle);
}

}  // namespace

void add_detect_command(CLI::App& app) {
  auto arguments = std::make_shared<DetectArguments>();
  CLI::App* command = app.add_subcommand("detect", "print the detections of a network in images");
  command->add_option("images", arguments->images, "image files")->required();
  command->add_option("--model", arguments->network.model, "network (.onnx)")->required();
  command->add_option("--backend", arguments->network.backend, "inference library")
      ->capture_default_str();
  command->add_option("--threads", arguments->network.threads, "threads of the network")
      ->capture_default_str();
  command->add_option("--confidence", arguments->network.confidence, "minimum confidence [0..1]")
      ->capture_default_str();
  command->add_option("--iou", arguments->network.iou, "IoU of non-maximum suppression [0..1]")
      ->capture_default_str();
  command
      ->add_option("--repeat", arguments->repeat,
                   "runs per image; with 2 or more the median time is printed")
      ->capture_default_str();
  command->callback([arguments] { detect(*arguments); });
}

}  // namespace stillmap::lab
