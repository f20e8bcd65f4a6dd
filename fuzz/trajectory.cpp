// SPDX-License-Identifier: Apache-2.0
// Trajectories, and the matrix between a tracked body and the camera.
#include "stillmap/geometry/trajectory.hpp"

#include "stillmap/evaluate/truth_frame.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  Trajectory trajectory(3);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    trajectory[i].timestamp = 0.1 * static_cast<double>(i);
    trajectory[i].T_world_camera = Pose(so3_exp({0.1, 0, 0.2}), {1, 2, 3});
  }
  const auto file = file_with("", "trajectory.txt");
  write_trajectory(file, trajectory);
  return {content_of(file), "# comment\n1,0,0,0,0,0,0,1\r\n2 1e-3 +.5 -2. 0 0 .6 .8\n",
          "1 0 0 .1\n0 1 0 .2\n0 0 1 .3\n0 0 0 1\n"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] { read_trajectory(file); });
  fuzz::parse([&] { read_truth_frame(file.string()); });
  return 0;
}
