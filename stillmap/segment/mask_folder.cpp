// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_folder.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/mask_image.hpp"
#include "stillmap/sensor/named_time.hpp"

#include <set>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Largest time tolerance of masks [s]: the association limit of TUM's tools.
constexpr double kTolerance = 0.02;
/// Interval of the masks whose outlines are compared with the depth, which takes some milliseconds.
constexpr std::size_t kChecked = 5;
/// Agreement with the depth below which masks are not of their images: see MaskAgreement.
constexpr double kLeastAgreement = 0.4;
/// Value of people in masks.
constexpr int kPersonValue = 255;
/// Class ids of the instances.
constexpr int kPersonClass = 0, kUnknownClass = 1;
/// Smaller regions are ignored as specks [pixels].
constexpr int kMinPixels = 16;

/// Returns the time in the name of a mask [s]. A whole number is a number of seconds here; it is
/// used only for frames without a name.
std::optional<double> time_in(const std::string& name) {
  if (!named_number(name)) return named_time(name, 1);
  const auto value = number_of(name);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

bool is_png(const std::filesystem::path& file) {
  return file.extension() == ".png" || file.extension() == ".PNG";
}

std::vector<std::filesystem::path> pngs_in(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (is_png(entry.path())) files.push_back(entry.path());
  }
  if (error) {
    throw Error("cannot read the folder of masks: " + error.message(), folder.string(),
                "name a folder with one 8-bit PNG per frame");
  }
  if (files.empty()) {
    throw Error("there is no PNG in the folder of masks", folder.string(),
                "name a folder with one 8-bit PNG per frame");
  }
  std::sort(files.begin(), files.end());
  return files;
}

double median_interval(const std::vector<double>& stamps) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) gaps.push_back(stamps[i] - stamps[i - 1]);
  return upper_median(gaps);
}

std::set<int> values_in(const cv::Mat1b& mask) {
  std::array<bool, 256> seen{};
  for (const std::uint8_t value : mask) seen[value] = true;
  std::set<int> values;
  for (int v = 1; v < 256; ++v) {
    if (seen[static_cast<std::size_t>(v)]) values.insert(v);
  }
  return values;
}

Instance make_instance(int value, const cv::Rect& box, const cv::Mat1i& labels, int label) {
  const bool person = value == kPersonValue;
  return {.class_id = person ? kPersonClass : kUnknownClass,
          .class_name = person ? "person" : "unknown",
          .confidence = 1,
          .box = box,
          .mask = labels(box) == label};
}

void append_pieces(const cv::Mat1b& mask, int value, std::vector<std::pair<int, Instance>>& sized) {
  cv::Mat1i labels, stats;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(mask == value, labels, stats, centers, 8);
  for (int label = 1; label < count; ++label) {
    const int area = stats(label, cv::CC_STAT_AREA);
    if (area < kMinPixels) continue;
    const cv::Rect box(stats(label, cv::CC_STAT_LEFT), stats(label, cv::CC_STAT_TOP),
                       stats(label, cv::CC_STAT_WIDTH), stats(label, cv::CC_STAT_HEIGHT));
    sized.emplace_back(area, make_instance(value, box, labels, label));
  }
}

}  // namespace

std::vector<Instance> instances_of_mask(const cv::Mat1b& mask) {
  std::vector<std::pair<int, Instance>> sized;
  for (const int value : values_in(mask)) append_pieces(mask, value, sized);
  std::stable_sort(sized.begin(), sized.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Instance> instances;
  for (auto& [area, instance] : sized) instances.push_back(std::move(instance));
  return instances;
}

MaskFolder::MaskFolder(const std::filesystem::path& folder) : folder_(folder) {
  std::vector<double> stamps;
  for (const auto& file : pngs_in(folder)) {
    const std::string name = file.stem().string();
    by_name_.emplace(name, file);
    if (const auto number = named_time(name, 1)) by_number_.emplace(*number, file);
    counts_frames_ = counts_frames_ || named_number(name).value_or(0) > 0;
    const auto stamp = time_in(name);
    if (stamp) stamps.push_back(*stamp);
    entries_.push_back({stamp.value_or(0), file});
  }
  stamped_ = stamps.size() == entries_.size();
  if (!stamped_) return;
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.stamp < b.stamp; });
  std::sort(stamps.begin(), stamps.end());
  tolerance_ = stamps.size() > 1 ? std::min(median_interval(stamps) / 2, kTolerance) : kTolerance;
}

const std::filesystem::path* MaskFolder::find(const RgbdFrame& frame) const {
  if (!frame.name.empty()) {
    if (const auto same = by_name_.find(frame.name); same != by_name_.end()) return &same->second;
    const auto number = named_time(frame.name, 1);
    const auto same = number ? by_number_.find(*number) : by_number_.end();
    if (same != by_number_.end()) return &same->second;
    if (counts_frames_) return nullptr;  // A number is not a time if the images have names.
  }
  if (stamped_) return nearest_in_time(frame.timestamp);
  return frame.index < entries_.size() ? &entries_[frame.index].file : nullptr;
}

const std::filesystem::path* MaskFolder::nearest_in_time(double timestamp) const {
  const auto after = std::lower_bound(entries_.begin(), entries_.end(), timestamp,
                                      [](const Entry& e, double stamp) { return e.stamp < stamp; });
  const Entry* best = nullptr;
  const auto distance = [&](const Entry& e) { return std::abs(e.stamp - timestamp); };
  if (after != entries_.end()) best = &*after;
  if (after != entries_.begin() && (!best || distance(*(after - 1)) <= distance(*best))) {
    best = &*(after - 1);
  }
  return best && distance(*best) <= tolerance_ ? &best->file : nullptr;
}

std::vector<Instance> MaskFolder::detect(const RgbdFrame& frame) {
  const std::filesystem::path* file = find(frame);
  if (!file) {
    ++missing_;
    return {};
  }
  const auto [mask, problem] = read_mask(*file, frame.gray.size());
  if (!problem.empty()) {
    if (unusable_++ == 0) {
      first_problem_ = fmt::format("{} {}", file->filename().string(), problem);
      warn(fmt::format("{} {}: this mask and similar ones are ignored", file->string(), problem),
           fmt::format("write an 8-bit gray PNG of {} x {} pixels: 0 static, 255 person, other "
                       "values another moving object",
                       frame.gray.cols, frame.gray.rows));
    }
    return {};
  }
  if (used_++ % kChecked == 0) agreement_.add(mask, frame.depth);
  return instances_of_mask(mask);
}

std::optional<Finding> MaskFolder::finding() const {
  if (agreement_.inverted()) {
    return make_finding(
        "masks-inverted",
        fmt::format("the masks in {} look inverted: most of each image is not 0 in them, and what "
                    "is 0 stands in front of it",
                    folder_.string()),
        "write 0 for what is static and 255 for people (mogrify -negate *.png in a copy of the "
        "folder inverts them)");
  }
  const std::optional<double> agreement = agreement_.agreement();
  if (!agreement || *agreement >= kLeastAgreement) return std::nullopt;
  return make_finding(
      "masks-unrelated",
      fmt::format(
          "the outlines of the masks in {} are not where the depth jumps (agreement {:.2f} of 1), "
          "so they are of another recording or moment, or are enlarged by far",
          folder_.string(), std::max(*agreement, 0.0)),
      "name the masks of these images, not enlarged (dense.mask_dilation does that)",
      {{"agreement", *agreement}});
}

std::string MaskFolder::description() const {
  return fmt::format("masks from {} ({}, by {})", folder_.string(),
                     counted(entries_.size(), "file"),
                     stamped_ ? "name or timestamp" : "name or order");
}

std::string MaskFolder::skipped() const {
  if (missing_ + unusable_ == 0) return {};
  std::string text = counted(missing_, "frame") + " without a mask";
  if (unusable_ > 0)
    text += fmt::format(", {}; the first: {}", counted(unusable_, "unusable mask"), first_problem_);
  return text;
}

const std::vector<std::string>& MaskFolder::class_names() const {
  static const std::vector<std::string> kNames = {"person", "unknown"};
  return kNames;
}

}  // namespace stillmap
