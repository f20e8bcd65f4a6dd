// SPDX-License-Identifier: Apache-2.0
// The folder of a finished run, as `stillmap view` reads it: the contents of kFiles, each ended by
// a zero byte. A file without content does not exist.
#include "stillmap/base/file.hpp"
#include "stillmap/view/recorded_view.hpp"
#include "stillmap/warn/warning_monitor.hpp"

#include <array>

#include "fuzz/fuzz_target.hpp"

namespace {

namespace fs = std::filesystem;

constexpr std::array kFiles{"trajectory.txt", "summary.json", "trajectory_live.txt", "movers.csv",
                            "objects.json",   "events.jsonl", "keyframes.txt",       "floor.json"};

fs::path folder_with(std::string_view input) {
  const fs::path folder = stillmap::fuzz::file_with("", "name").parent_path() / "run";
  fs::create_directories(folder);
  for (const char* name : kFiles) {
    const std::string_view content = input.substr(0, input.find('\0'));
    input.remove_prefix(std::min(content.size() + 1, input.size()));
    fs::remove(folder / name);
    if (!content.empty()) stillmap::write_file(folder / name, content);
  }
  return folder;
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  WarningEvent warning;
  warning.rule = "gate";
  warning.position = Eigen::Vector3d(0, 0, 2);
  const std::array<std::string, kFiles.size()> contents{
      "1 0 0 0 0 0 0 1\n1.1 0.1 0 0 0 0 0 1\n",
      R"({"sequence": "office", "loops": [{"timestamp": 1.1, "keyframe": 3, "matched": 1}],
          "relocalizations": [{"timestamp": 1.1}], "frames": {"tracked": 2}})",
      "",
      "timestamp,id,class,state,x,y,z,vx,vy,vz,min_x,min_y,min_z,max_x,max_y,max_z\n"
      "1,1,person,observed,0,0,2,0,0,0,-1,-1,1,1,1,3\n",
      R"({"objects": [{"id": 1, "class": "chair", "points": 9, "box": {"min": [0, 0, 0]}}]})",
      warning_json(warning).dump(),
      "1 0 0 0 0 0 0 1\n",
      R"({"floor": null, "up": [0, -1, 0]})"};
  std::string seed;
  for (const std::string& content : contents) seed += content + '\0';
  return {seed};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto folder = folder_with(fuzz::text_of(data, size));
  fuzz::parse([&] {
    TopicBoard board;
    publish_recorded_run(folder, std::nullopt, board);
  });
  return 0;
}
