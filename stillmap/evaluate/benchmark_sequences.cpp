// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/benchmark_sequences.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <regex>
#include <tuple>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTumPage = "https://cvg.cit.tum.de/data/datasets/rgbd-dataset/download";

/// The dynamic sequences of TUM freiburg3 in the order in which they are shown.
constexpr std::array<const char*, 8> kPaperSequences{
    "walking_xyz", "walking_halfsphere", "walking_rpy", "walking_static",
    "sitting_xyz", "sitting_halfsphere", "sitting_rpy", "sitting_static"};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_recording(const fs::path& folder) {
  const auto has = [&](const char* name) { return fs::exists(folder / name); };
  return has("groundtruth.txt") &&
         ((has("rgb.txt") && has("depth.txt")) || has("associations.txt"));
}

/// Returns the position of a sequence in the output: the papers' first.
std::size_t rank(const std::string& name) {
  return static_cast<std::size_t>(std::find(kPaperSequences.begin(), kPaperSequences.end(), name) -
                                  kPaperSequences.begin());
}

bool is_of_papers(const std::string& name) { return rank(name) < kPaperSequences.size(); }

BenchmarkSequence sequence_in(const fs::path& folder, const std::string& name) {
  BenchmarkSequence sequence{name, folder, "", ""};
  if (!fs::exists(folder / "camera.yaml")) {
    if (is_of_papers(name)) sequence.camera = "tum_fr3";
    if (name.starts_with("fr1_")) sequence.camera = "tum_fr1";
  }
  if (name.starts_with("bonn_")) sequence.truth_frame = "bonn";
  return sequence;
}

/// Returns the recordings of a folder with their names; unknown ones have that of their folder.
std::vector<BenchmarkSequence> all_recordings(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw Error("is not a folder", folder.string(), "name the folder that contains the sequences");
  }
  std::vector<BenchmarkSequence> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory() || !is_recording(entry.path())) continue;
    const std::string own = entry.path().filename().string(), known = benchmark_name(own);
    found.push_back(sequence_in(entry.path(), known.empty() ? own : known));
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::tuple(rank(a.name), a.name, a.folder) < std::tuple(rank(b.name), b.name, b.folder);
  });
  return found;
}

}  // namespace

std::string benchmark_name(const std::string& folder) {
  static const std::regex kTum3(
      "(?:rgbd_dataset_)?(?:(?:freiburg|fr)3_)?(walking|sitting|w|s)_(static|xyz|rpy|halfsphere|"
      "half)");
  static const std::regex kTum1("(?:rgbd_dataset_)?(?:freiburg|fr)1_rpy");
  static const std::regex kBonn("(?:rgbd_)?(bonn_.+)");
  static const std::regex kOwn("(?:kitchen|yard)_.+");
  const std::string name = lower(folder);
  std::smatch match;
  if (std::regex_match(name, match, kTum3)) {
    const std::string people = match[1].str().front() == 'w' ? "walking" : "sitting";
    return people + "_" + (match[2] == "half" ? "halfsphere" : match[2].str());
  }
  if (std::regex_match(name, kTum1)) return "fr1_rpy";
  if (std::regex_match(name, match, kBonn)) return match[1];
  return std::regex_match(name, kOwn) ? name : "";
}

std::vector<BenchmarkSequence> find_benchmark_sequences(const fs::path& folder,
                                                        const std::vector<std::string>& names) {
  const std::vector<BenchmarkSequence> all = all_recordings(folder);
  std::vector<BenchmarkSequence> chosen;
  if (names.empty()) {
    std::copy_if(all.begin(), all.end(), std::back_inserter(chosen), [](const auto& sequence) {
      return !benchmark_name(sequence.folder.filename().string()).empty();
    });
    return chosen;
  }
  for (const std::string& name : names) {
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& sequence) {
      return sequence.name == name || sequence.folder.filename() == name;
    });
    if (found == all.end()) {
      std::vector<std::string> known;
      for (const auto& sequence : all) known.push_back(sequence.name);
      throw Error(fmt::format("there is no recording '{}' with ground truth", name),
                  folder.string(), suggestion(name, known));
    }
    chosen.push_back(*found);
  }
  return chosen;
}

std::string download_hint(const std::string& name) {
  return fmt::format("rgbd_dataset_freiburg3_{}, {}", name, kTumPage);
}

}  // namespace stillmap
