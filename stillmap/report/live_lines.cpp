// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/live_lines.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"

namespace stillmap {

LiveLines::LiveLines(ResultFolder& folder, std::string name, const std::string& heading)
    : folder_(&folder), name_(std::move(name)), whole_(heading.size()) {
  folder.write(name_, [&](const std::filesystem::path& file) {
    write_file(file, heading);
    file_.open(file, std::ios::app);
  });
}

void LiveLines::add(const std::string& line) {
  if (!file_.is_open()) return;
  file_ << line << std::flush;
  if (file_) {
    whole_ += line.size();
    return;
  }
  file_.close();
  folder_->write(name_, [&](const std::filesystem::path& file) {
    std::error_code ignored;
    std::filesystem::resize_file(file, whole_, ignored);
    throw Error("cannot be written any more, so its later lines are missing", file.string(),
                "free space on the disk");
  });
}

}  // namespace stillmap
