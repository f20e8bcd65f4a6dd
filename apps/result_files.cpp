// SPDX-License-Identifier: Apache-2.0
#include "result_files.hpp"

#include "stillmap/base/error.hpp"

namespace stillmap {

void ResultFiles::write(const std::filesystem::path& file,
                        const std::function<void(const std::filesystem::path&)>& writer) {
  try {
    writer(file);
    written_.push_back(file);
  } catch (const Error& e) {
    failures_ += std::string(e.what()) + "\n";
  }
}

void ResultFiles::require_all() const {
  if (!failures_.empty()) throw Error("not all results could be saved:\n" + failures_, "", "");
}

}  // namespace stillmap
