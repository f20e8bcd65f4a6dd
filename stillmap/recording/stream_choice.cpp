// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/stream_choice.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/recording/name_text.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <iterator>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

int color_score(const ImageStream& stream) {
  if (stream.is_depth()) return 0;
  const std::string name = lower(stream.name);
  int score = contains_any(lower(stream.encoding), {"mono", "8uc1"}) ? 5 : 10;
  if (contains_any(name, {"color", "colour", "rgb"})) score += 4;
  if (contains_any(name, {"infra", "/ir", "left", "right", "thermal", "fisheye"})) score -= 4;
  // The depth of a stereo camera belongs to its left images.
  if (contains_any(name, {"infra2", "infrared_2", "right"})) score -= 1;
  if (contains_any(name, {"depth", "disparity", "confidence"}) &&
      !contains_any(name, {"rgb_to_depth", "color_to_depth"}))
    score -= 9;
  if (stream.storage == ImageStorage::kPixels) score += 1;
  return score;
}

int depth_score(const ImageStream& stream, const ImageStream& color) {
  if (!stream.is_depth()) return 0;
  const std::string name = lower(stream.name);
  int score = 5;
  if (contains_any(name, {"depth"})) score += 4;
  if (contains_any(name, {"infra", "/ir", "confidence", "disparity", "thermal"})) score -= 9;
  if (stream.frame == color.frame) score += 2;
  if (contains_any(name, {"aligned", "registered", "to_color", "to_rgb"})) score += 3;
  if (stream.storage == ImageStorage::kPixels) score += 1;
  return score;
}

// Returns the words in the name of a topic or frame that identify a camera, such as "front" in
// "/front/color/image_raw" and "2" in "/camera2/depth", without words for the kinds of its images.
std::set<std::string> camera_words(const std::string& name) {
  static const std::set<std::string> kKinds{
      "align",      "aligned",      "cam",        "camera",
      "color",      "colour",       "compressed", "compresseddepth",
      "data",       "depth",        "frame",      "hw",
      "image",      "images",       "img",        "link",
      "mono",       "optical",      "raw",        "rect",
      "rectified",  "registration", "rgb",        "rgbd",
      "registered", "stereo",       "sw",         "to",
      "video",      "sensor"};
  std::vector<std::string> words;
  bool inside = false;  // whether the previous character is in a word
  for (const char c : lower(name)) {
    const bool letter = std::isalpha(static_cast<unsigned char>(c)) != 0;
    const bool digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    // "device_0" is one word, like "device0".
    if (letter && !inside) words.emplace_back();
    if (digit && words.empty()) words.emplace_back();
    if (letter || digit) words.back() += c;
    inside = letter || (digit && inside);
  }
  std::set<std::string> telling;
  for (const std::string& word : words) {
    const std::string kind = word.substr(0, word.find_last_not_of("0123456789") + 1);
    // librealsense numbers the sensors of a device by the kinds of their images.
    if (kind == "sensor") continue;
    const std::string left = kKinds.contains(kind) ? word.substr(kind.size()) : word;
    if (!left.empty()) telling.insert(left);
  }
  return telling;
}

// Returns the number of words that only one of the names has.
std::size_t different_words(const std::string& a, const std::string& b) {
  const auto words_a = camera_words(a), words_b = camera_words(b);
  std::vector<std::string> different;
  std::set_symmetric_difference(words_a.begin(), words_a.end(), words_b.begin(), words_b.end(),
                                std::back_inserter(different));
  return different.size();
}

std::size_t different_words(const ImageStream& a, const ImageStream& b) {
  const bool framed = !a.frame.empty() && !b.frame.empty();
  return different_words(a.name, b.name) + (framed ? different_words(a.frame, b.frame) : 0);
}

// A color and a depth stream.
struct StreamPair {
  const ImageStream* color = nullptr;
  const ImageStream* depth = nullptr;
  bool apart = false;     // the transform between them shows two cameras
  std::size_t words = 0;  // result of different_words()
  int score = 0;          // for the kinds of their images
  double distance = 0;    // [m], if a transform is known
  std::size_t frames() const { return std::min(color->images.size(), depth->images.size()); }
  // Smaller is better.
  auto rank() const {
    return std::tuple(apart, words, -score, distance, -static_cast<double>(frames()));
  }
};

// Returns all pairs that can be color and depth.
std::vector<StreamPair> stream_pairs(const std::vector<ImageStream>& streams, FrameTree& frames) {
  // Between cameras of one device [m], [rad]; a body and its optical frame differ by 120 degrees.
  constexpr double kFarthest = 0.3, kLargestAngle = 2.2;
  std::vector<StreamPair> pairs;
  for (const ImageStream& color : streams) {
    for (const ImageStream& depth : streams) {
      const int color_points = color_score(color), depth_points = depth_score(depth, color);
      if (color_points <= 0 || depth_points <= 0) continue;
      pairs.push_back({.color = &color,
                       .depth = &depth,
                       .words = different_words(color, depth),
                       .score = color_points + depth_points});
    }
  }
  if (pairs.size() < 2) return pairs;  // Reading transforms can take long.
  for (StreamPair& pair : pairs) {
    const std::string &a = pair.color->frame, &b = pair.depth->frame;
    const auto T = a.empty() || b.empty() || a == b ? std::nullopt : frames.find(a, b);
    if (!T) continue;
    pair.distance = T->translation().norm();
    pair.apart = pair.distance > kFarthest || T->angle() > kLargestAngle;
  }
  return pairs;
}

const StreamPair* best(const std::vector<StreamPair>& pairs) {
  const auto found = std::min_element(
      pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.rank() < b.rank(); });
  return found == pairs.end() ? nullptr : &*found;
}

// Returns a sentence for each camera other than the chosen one that also has color and depth.
std::vector<std::string> other_cameras(std::vector<StreamPair> pairs, const StreamPair& chosen) {
  std::vector<std::string> notes;
  StreamPair last = chosen;
  while (true) {
    std::erase_if(pairs, [&](const StreamPair& pair) {
      return pair.apart || pair.words > chosen.words ||
             different_words(*pair.color, *last.color) == 0 ||
             different_words(*pair.depth, *last.depth) == 0;
    });
    const StreamPair* next = best(pairs);
    if (next == nullptr) return notes;
    last = *next;
    notes.push_back(fmt::format("another camera has {}; to use it: --topics {},{}",
                                counted(last.frames(), "image"), last.color->name,
                                last.depth->name));
  }
}

std::vector<std::string> names_and_encodings(const std::vector<ImageStream>& streams) {
  std::vector<std::string> texts;
  for (const ImageStream& stream : streams)
    texts.push_back(stream.encoding.empty() ? stream.name
                                            : fmt::format("{} ({})", stream.name, stream.encoding));
  return texts;
}

Error no_stream(const Recording& recording, const std::vector<ImageStream>& streams,
                const char* kind) {
  std::string fix = "record one";
  if (!streams.empty()) {
    fix = fmt::format(
        "name two topics with --topics COLOR,DEPTH (of a stereo pair LEFT,RIGHT); the image "
        "topics are {}",
        fmt::join(names_and_encodings(streams), ", "));
  }
  std::string what = fmt::format("contains no topic with {} images that can be read", kind);
  for (const Topic& topic : recording.topics()) {
    if (topic.type.find("Image") == std::string::npos || topic.type.starts_with("sensor_msgs/"))
      continue;
    what += fmt::format("; {} has messages of type {}, and only those of sensor_msgs are read",
                        topic.name, topic.type);
  }
  for (const std::string& warning : recording.warnings()) what += "; " + warning;
  return Error(what, recording.path().string(), fix);
}

}  // namespace

std::tuple<ImageStream, ImageStream, std::vector<std::string>> best_streams(
    const Recording& recording, const std::vector<ImageStream>& streams, FrameTree& frames) {
  const std::vector<StreamPair> pairs = stream_pairs(streams, frames);
  const StreamPair* chosen = best(pairs);
  if (chosen == nullptr) {
    const bool has_color =
        std::any_of(streams.begin(), streams.end(),
                    [](const ImageStream& stream) { return color_score(stream) > 0; });
    throw no_stream(recording, streams, has_color ? "depth" : "color");
  }
  return {*chosen->color, *chosen->depth, other_cameras(pairs, *chosen)};
}

}  // namespace stillmap
