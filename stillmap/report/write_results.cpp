// SPDX-License-Identifier: Apache-2.0
#include "stillmap/write_results.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/pipeline/run_details.hpp"
#include "stillmap/report/run_folder.hpp"

#include <utility>

namespace stillmap {
namespace {

/// Returns the name of a folder without a trailing slash.
std::string name_of(const std::filesystem::path& folder) {
  const auto path = std::filesystem::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

}  // namespace

std::vector<std::filesystem::path> write_results(const Results& results,
                                                 const std::filesystem::path& folder,
                                                 const std::string& title) {
  if (!results.details) {
    throw Error("the results are empty", "write_results", "pass the results of Slam::finish()");
  }
  if (folder.empty()) throw Error("the name of the folder is empty", "write_results", "name one");
  RunRecord record;
  static_cast<RunDetails&>(record) = *results.details;
  record.sequence = title.empty() ? name_of(folder) : title;
  record.machine = machine_description();
  record.mapping_memory_mib = peak_memory_mib();
  return write_run_folder(std::move(record), folder);
}

}  // namespace stillmap
