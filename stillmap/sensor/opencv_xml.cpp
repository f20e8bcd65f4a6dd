// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/opencv_xml.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::string_view kRoot = "<opencv_storage>";
constexpr int kDeepest = 16;  // Levels of elements; those of cameras have three.

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  text = text.substr(first, text.find_last_not_of(kBlank) - first + 1);
  const bool quoted = text.size() > 1 && text.front() == '"' && text.back() == '"';
  return quoted ? text.substr(1, text.size() - 2) : text;
}

class XmlReader {
 public:
  XmlReader(std::string_view text, std::filesystem::path file)
      : text_(text), file_(std::move(file)) {}

  /// Returns the content of the element that has begun, and moves past its end.
  YAML::Node element(const std::string& name, int level) {
    if (level > kDeepest) throw problem("nests its elements too deeply");
    YAML::Node map, list;
    const std::size_t begin = at_;
    while (true) {
      const std::string tag = next_tag(name);
      if (tag == '/' + name) break;
      const bool empty = tag.ends_with('/');
      const std::string child = tag.substr(0, tag.find_first_of(" \t\r\n/"));
      const YAML::Node content = empty ? YAML::Node("") : element(child, level + 1);
      if (child == "_")
        list.push_back(content);
      else
        map.force_insert(child, content);
    }
    if (map.size() > 0) return map;
    if (list.size() > 0) return list;
    return YAML::Node(std::string(trimmed(text_.substr(begin, tag_begin_ - begin))));
  }

 private:
  /// Returns the next tag without its brackets, and moves past it.
  std::string next_tag(const std::string& parent) {
    while (true) {
      tag_begin_ = text_.find('<', at_);
      const bool comment = text_.substr(std::min(tag_begin_, text_.size())).starts_with("<!--");
      const std::string_view end = comment ? "-->" : ">";
      const auto tag_end = tag_begin_ == std::string_view::npos ? std::string_view::npos
                                                                : text_.find(end, tag_begin_);
      if (tag_end == std::string_view::npos)
        throw problem(fmt::format("is truncated: <{}> does not end", printable(parent)));
      at_ = tag_end + end.size();
      if (!comment) return std::string(text_.substr(tag_begin_ + 1, tag_end - tag_begin_ - 1));
    }
  }

  Error problem(const std::string& what) const {
    return Error(what, file_.string(), "write the file again with cv::FileStorage");
  }

  std::string_view text_;
  std::filesystem::path file_;
  std::size_t at_ = 0;
  std::size_t tag_begin_ = 0;  // position of the last tag
};

}  // namespace

bool is_opencv_xml(const std::string& text) {
  return trimmed(text).starts_with('<') && text.find(kRoot) != std::string::npos;
}

YAML::Node parse_opencv_xml(const std::string& text, const std::filesystem::path& file) {
  const std::string_view below = std::string_view(text).substr(text.find(kRoot) + kRoot.size());
  return XmlReader(below, file).element("opencv_storage", 0);
}

}  // namespace stillmap
