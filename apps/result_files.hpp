// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace stillmap {

/// The files that a command writes: one that cannot be written does not keep the others from it.
class ResultFiles {
 public:
  /// Writes one file; an Error is kept for later.
  void write(const std::filesystem::path& file,
             const std::function<void(const std::filesystem::path&)>& writer);

  /// Those that were written, in this order.
  const std::vector<std::filesystem::path>& written() const { return written_; }

  /// Throws Error, with all that was wrong, if one could not be written.
  void require_all() const;

 private:
  std::vector<std::filesystem::path> written_;
  std::string failures_;
};

}  // namespace stillmap
