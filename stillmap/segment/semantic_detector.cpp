// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/semantic_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/segment/mask_depth.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Smallest object [pixels of SmallFrame]; less is noise at the borders of classes.
constexpr int kLeastArea = 64;
/// Maximum difference of the median depths of two touching pieces of one object [m]: an arm's
/// length.
constexpr float kObjectDepth = 0.5F;
/// A piece smaller than its touching neighbor by this factor belongs to it.
constexpr std::size_t kSmallPart = 4;

/// The classes of Pascal VOC by COCO's names.
const std::vector<std::string>& voc_class_names() {
  static const std::vector<std::string> names = {
      "background", "airplane", "bicycle",      "bird",  "boat",         "bottle", "bus",
      "car",        "cat",      "chair",        "cow",   "dining table", "dog",    "horse",
      "motorcycle", "person",   "potted plant", "sheep", "couch",        "train",  "tv"};
  return names;
}

/// A part of a mask on one surface.
struct Piece {
  std::vector<int> pixels;  // Indices into the mask.
  float depth = 0;          // Median [m]; 0: unknown.
  std::set<int> touching;   // Indices of the pieces next to it.
};

/// Calls `visit(q)` for the 4-neighbors q of pixel p.
template <typename Visit>
void for_neighbors(int p, cv::Size size, Visit&& visit) {
  const int x = p % size.width;
  if (x > 0) visit(p - 1);
  if (x + 1 < size.width) visit(p + 1);
  if (p >= size.width) visit(p - size.width);
  if (p + size.width < size.area()) visit(p + size.width);
}

/// Labels pixels of the mask from `seeds` on: a neighbor gets the label of the pixel before it if
/// `joins(pixel, neighbor)`. -1: no label yet.
template <typename Joins>
void spread(std::vector<int> front, const cv::Mat1b& mask, cv::Mat1i& label, Joins&& joins) {
  const auto* inside = mask.ptr<std::uint8_t>();
  auto* labels = label.ptr<int>();
  for (std::vector<int> next; !front.empty(); front.swap(next), next.clear()) {
    for (const int p : front) {
      for_neighbors(p, mask.size(), [&](int q) {
        if (inside[q] == 0 || labels[q] >= 0 || !joins(p, q)) return;
        labels[q] = labels[p];
        next.push_back(q);
      });
    }
  }
}

/// Returns the number of the piece for each pixel of the mask, -1 elsewhere.
cv::Mat1i label_pieces(const cv::Mat1b& mask, const cv::Mat1f& depth) {
  cv::Mat1i label(mask.size(), -1);
  const auto* inside = mask.ptr<std::uint8_t>();
  const auto* z = depth.ptr<float>();
  auto* labels = label.ptr<int>();
  const int count = mask.size().area();
  int pieces = 0;
  const auto same_surface = [&](int p, int q) {
    return z[q] > 0 && std::abs(z[p] - z[q]) < surface_step(z[p]);
  };
  for (int p = 0; p < count; ++p) {
    if (inside[p] == 0 || labels[p] >= 0 || z[p] <= 0) continue;
    labels[p] = pieces++;
    spread({p}, mask, label, same_surface);
  }
  const auto any = [](int, int) { return true; };
  std::vector<int> labeled;
  for (int p = 0; p < count; ++p) {
    if (labels[p] >= 0) labeled.push_back(p);
  }
  spread(std::move(labeled), mask, label, any);
  for (int p = 0; p < count; ++p) {  // parts of the mask without any depth
    if (inside[p] == 0 || labels[p] >= 0) continue;
    labels[p] = pieces++;
    spread({p}, mask, label, any);
  }
  return label;
}

std::vector<Piece> pieces_of(const cv::Mat1i& label, const cv::Mat1f& depth) {
  const auto* labels = label.ptr<int>();
  const int count = label.size().area();
  std::vector<Piece> pieces(
      static_cast<std::size_t>(*std::max_element(labels, labels + count) + 1));
  for (int p = 0; p < count; ++p) {
    if (labels[p] < 0) continue;
    Piece& piece = pieces[static_cast<std::size_t>(labels[p])];
    piece.pixels.push_back(p);
    for_neighbors(p, label.size(), [&](int q) {
      if (labels[q] >= 0 && labels[q] != labels[p]) piece.touching.insert(labels[q]);
    });
  }
  for (Piece& piece : pieces) {
    std::vector<float> depths;
    for (const int p : piece.pixels) {
      if (const float z = depth.ptr<float>()[p]; z > 0) depths.push_back(z);
    }
    if (!depths.empty()) piece.depth = upper_median(depths);
  }
  return pieces;
}

/// Returns the first piece of the object to which a piece belongs, itself if it starts one.
/// @param object  first piece of the object of each larger piece, -1 of the others
std::size_t object_of(std::size_t piece, const std::vector<Piece>& pieces,
                      const std::vector<int>& object) {
  const Piece& own = pieces[piece];
  std::size_t best = piece;
  float nearest = std::numeric_limits<float>::infinity();
  for (const int other : own.touching) {
    const int first = object[static_cast<std::size_t>(other)];
    if (first < 0) continue;
    const Piece& whole = pieces[static_cast<std::size_t>(first)];
    const float apart = std::abs(whole.depth - own.depth);
    const bool part = own.pixels.size() * kSmallPart < whole.pixels.size();
    if ((apart < kObjectDepth || part) && apart < nearest) {
      best = static_cast<std::size_t>(first);
      nearest = apart;
    }
  }
  return best;
}

/// The class of each pixel of a network's output and its probability.
struct Labels {
  cv::Mat1b id;
  cv::Mat1f probability;
};

Labels labels_in(const TensorView& scores) {
  const auto classes = static_cast<std::size_t>(scores.shape[3]);
  const cv::Size size(static_cast<int>(scores.shape[2]), static_cast<int>(scores.shape[1]));
  Labels labels{cv::Mat1b(size), cv::Mat1f(size)};
  for (int i = 0; i < size.area(); ++i) {
    const auto values = scores.values.subspan(static_cast<std::size_t>(i) * classes, classes);
    const auto top = std::max_element(values.begin(), values.end());
    float sum = 0;
    for (const float value : values) sum += std::exp(value - *top);
    labels.id.ptr<std::uint8_t>()[i] = static_cast<std::uint8_t>(top - values.begin());
    labels.probability.ptr<float>()[i] = 1 / sum;
  }
  return labels;
}

}  // namespace

std::vector<cv::Mat1b> split_by_depth(const cv::Mat1b& mask, const cv::Mat1f& depth) {
  CV_Assert(mask.size() == depth.size() && mask.isContinuous() && depth.isContinuous());
  if (cv::countNonZero(mask) == 0) return {};
  const std::vector<Piece> pieces = pieces_of(label_pieces(mask, depth), depth);
  std::vector<std::size_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return pieces[a].pixels.size() > pieces[b].pixels.size();
  });
  std::vector<int> object(pieces.size(), -1);
  std::vector<cv::Mat1b> masks(pieces.size());
  for (const std::size_t piece : order) {
    const std::size_t first = object_of(piece, pieces, object);
    object[piece] = static_cast<int>(first);
    if (masks[first].empty()) masks[first] = cv::Mat1b::zeros(mask.size());
    for (const int p : pieces[piece].pixels) masks[first].ptr<std::uint8_t>()[p] = 255;
  }
  std::erase_if(masks, [](const cv::Mat1b& m) { return m.empty(); });
  std::stable_sort(masks.begin(), masks.end(), [](const cv::Mat1b& a, const cv::Mat1b& b) {
    return cv::countNonZero(a) > cv::countNonZero(b);
  });
  return masks;
}

bool SemanticDetector::fits(const Network& network) {
  constexpr std::int64_t kMostClasses = 256;
  const auto shapes = network.output_shapes();
  return network.channels_last() && shapes.size() == 1 && shapes[0].size() == 4 &&
         shapes[0][0] == 1 && shapes[0][3] > 1 && shapes[0][3] <= kMostClasses;
}

SemanticDetector::SemanticDetector(Network network) : NetworkDetector(std::move(network)) {
  const auto classes = static_cast<std::size_t>(network_.output_shapes()[0][3]);
  if (class_names_.empty()) class_names_ = voc_class_names();
  if (class_names_.size() != classes) {
    throw Error(fmt::format("the network has {} classes, but the names of {} are known", classes,
                            class_names_.size()),
                network_.options().model,
                "write the class names into its metadata: names = {0: 'background', ...}");
  }
}

std::vector<Instance> SemanticDetector::detect(const RgbdFrame& frame) {
  constexpr float kScale = 2.0F / 255.0F;
  constexpr PixelFormat kFormat{
      .channels_last = true, .scale = {kScale, kScale, kScale}, .offset = {-1, -1, -1}};
  const auto letterbox = Letterbox::stretched(frame.color.size(), network_.input_size());
  const Labels labels = labels_in(network_.run_on(frame.color, letterbox, kFormat).front());
  const TraceScope scope("decode");
  RgbdFrame seen = frame;
  if (seen.depth.empty()) seen.depth = cv::Mat1f::zeros(seen.color.size());
  const SmallFrame small(seen);
  cv::Mat1b id;
  cv::Mat1f probability;
  cv::resize(labels.id, id, small.size(), 0, 0, cv::INTER_NEAREST);
  cv::resize(labels.probability, probability, small.size(), 0, 0, cv::INTER_NEAREST);
  std::vector<Instance> instances;
  for (int c = 1; c < static_cast<int>(class_names_.size()); ++c) {
    for (const cv::Mat1b& object : split_by_depth(cv::Mat1b(id == c), small.depth)) {
      if (cv::countNonZero(object) < kLeastArea) continue;
      const auto confidence = static_cast<float>(cv::mean(probability, object)[0]);
      if (confidence < network_.options().confidence) continue;
      Instance model{.class_id = c,
                     .class_name = class_names_[static_cast<std::size_t>(c)],
                     .confidence = confidence,
                     .box = {},
                     .mask = {}};
      instances.push_back(enlarge_mask({small.bounds(), object}, small, model));
    }
  }
  std::stable_sort(instances.begin(), instances.end(), [](const Instance& a, const Instance& b) {
    return a.confidence > b.confidence;
  });
  return instances;
}

}  // namespace stillmap
