// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/result_folder.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

namespace stillmap {

/// A text file of a run folder that grows line by line during the run. Each line is written at
/// once, so that those of a run that was killed are not lost.
class LiveLines {
 public:
  /// Starts the file in a folder that lives longer. Problems are kept for
  /// ResultFolder::require_all().
  /// @param heading  first lines, with their line ends; may be empty
  LiveLines(ResultFolder& folder, std::string name, const std::string& heading);
  /// Adds a line, with its line end. Where it cannot be written, the file ends with the line
  /// before.
  void add(const std::string& line);

 private:
  ResultFolder* folder_;
  std::string name_;
  std::ofstream file_;
  std::uintmax_t whole_ = 0;  // size of the whole lines [bytes]
};

}  // namespace stillmap
