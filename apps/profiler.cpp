// SPDX-License-Identifier: Apache-2.0
#include "profiler.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/profile.hpp"

#include "dense_outputs.hpp"
#include "machine.hpp"
#include "result_files.hpp"
#include <fmt/format.h>

namespace stillmap {

Profiler::Profiler(bool wanted)
    : track_(wanted ? &trace_.add_track("camera") : nullptr),
      binding_(track_),
      cpu_before_(process_cpu_ms()) {}

std::vector<std::filesystem::path> Profiler::finish(const std::filesystem::path& out) {
  if (track_ == nullptr) return {};
  const Profile profile = make_profile(trace_, process_cpu_ms() - cpu_before_);
  fmt::print("{}", profile_in_brief(profile));
  ResultFiles files;
  files.write(out / "profile.txt", [&](const auto& file) {
    write_file(file, machine_description() + "\n" + profile_text(profile));
  });
  files.write(out / "profile.png",
              [&](const auto& file) { write_png(file, draw_frame_budget(trace_)); });
  files.write(out / "trace.json", [&](const auto& file) { write_file(file, trace_json(trace_)); });
  files.require_all();
  return files.written();
}

}  // namespace stillmap
