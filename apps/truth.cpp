// SPDX-License-Identifier: Apache-2.0
#include "truth.hpp"

#include "stillmap/evaluate/truth_frame.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char *kBonn = "bonn", *kCamera = "camera";

bool is_of_bonn(const std::filesystem::path& truth) {
  const std::filesystem::path folder =
      std::filesystem::absolute(truth).lexically_normal().parent_path();
  std::string name = folder.filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.starts_with(std::string("rgbd_") + kBonn) || name.starts_with(kBonn);
}

}  // namespace

void add_truth_frame_option(CLI::App& command, std::string& truth_frame) {
  command.add_option(
      "--truth-frame", truth_frame,
      "the truth is the pose of a marker or robot, not of the camera: file with "
      "T_body_camera as 4 x 4 numbers, or 'bonn' for the Bonn RGB-D Dynamic Dataset (default in "
      "folders named like its sequences); 'camera': the truth is the pose of the camera");
}

std::string truth_frame_of(const std::filesystem::path& truth, const std::string& given) {
  if (given == kCamera) return "";
  return given.empty() && !truth.empty() && is_of_bonn(truth) ? kBonn : given;
}

Trajectory true_camera_trajectory(const std::filesystem::path& truth,
                                  const std::string& truth_frame) {
  Trajectory trajectory = read_trajectory(truth);
  if (truth_frame.empty()) return trajectory;
  return in_camera_frame(trajectory, read_truth_frame(truth_frame));
}

}  // namespace stillmap
