// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/trace.hpp"

#include <filesystem>
#include <optional>
#include <vector>

namespace stillmap {

/// Listens to the calling thread, and to the threads of all stages that it makes while this lives.
class Profiler {
 public:
  /// @param wanted  false: nothing is listened to, and nothing written
  explicit Profiler(bool wanted);

  /// Prints where the time went, and writes trace.json, profile.txt and profile.png into the
  /// folder. All other threads must rest, or have ended. What was written.
  std::vector<std::filesystem::path> finish(const std::filesystem::path& out);

 private:
  Trace trace_;
  TraceTrack* const track_;
  const TraceBinding binding_;
  const double cpu_before_;
};

}  // namespace stillmap
