// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/frame_times.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/sensor/camera_values.hpp"
#include "stillmap/sensor/fields.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStrayScannerFile = "odometry.csv";

/// Reads the table of a file with the columns timestamp and frame. It is empty without these
/// columns, as in early versions.
FrameTimes times_of_stray_scanner(const fs::path& file) {
  std::istringstream in(as_utf8(read_file(file)));
  std::string line;
  std::getline(in, line);
  const auto heading = fields_of(line);
  const auto column = [&](const char* name) {
    return static_cast<std::size_t>(std::find(heading.begin(), heading.end(), name) -
                                    heading.begin());
  };
  const std::size_t stamp = column("timestamp"), frame = column("frame");
  FrameTimes times;
  if (stamp == heading.size() || frame == heading.size()) return times;
  times.file = file;
  for (int number = 2; std::getline(in, line); ++number) {
    const auto columns = fields_of(line);
    if (columns.empty()) continue;
    const bool complete = columns.size() > std::max(stamp, frame);
    const auto time = complete ? number_of(columns[stamp]) : std::nullopt,
               index = complete ? number_of(columns[frame]) : std::nullopt;
    if (!time || !index || !std::isfinite(*time) || !(std::abs(*index) < 1e9)) {
      throw Error("has no valid timestamp and frame number",
                  fmt::format("{}:{}", file.string(), number),
                  "correct the line, or remove the file to take the times from --fps");
    }
    times.table.emplace(std::lround(*index), *time);
  }
  return times;
}

FrameTimes times_of_record3d(const fs::path& file) {
  const CameraValues values(file);
  FrameTimes times{.fps = values.number_or({"fps"}, FrameTimes().fps), .file = file, .table = {}};
  if (!values.has({"frameTimestamps"})) return times;
  long number = 0;
  for (const double time : values.numbers("frameTimestamps")) times.table.emplace(number++, time);
  return times;
}

}  // namespace

std::optional<double> FrameTimes::of(double number) const {
  if (table.empty()) return number / fps;
  const auto found = table.find(std::lround(number));
  return found == table.end() ? std::nullopt : std::optional(found->second);
}

bool is_of_record3d(const fs::path& folder) {
  if (!is_file(folder / kRecord3dFile)) return false;
  const std::string text = read_file(folder / kRecord3dFile);
  return text.find("\"K\"") != std::string::npos && text.find("\"dw\"") != std::string::npos;
}

FrameTimes frame_times(const SequencePaths& paths) {
  const bool rate_is_given = paths.fps != FrameTimes().fps;
  if (!rate_is_given && paths.layout == FolderLayout::kFolders) {
    if (is_file(paths.folder / kStrayScannerFile)) {
      FrameTimes times = times_of_stray_scanner(paths.folder / kStrayScannerFile);
      if (!times.table.empty()) return times;
    }
    if (is_of_record3d(paths.folder)) return times_of_record3d(paths.folder / kRecord3dFile);
  }
  return {.fps = paths.fps, .file = {}, .table = {}};
}

}  // namespace stillmap
