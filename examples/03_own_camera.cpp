// SPDX-License-Identifier: Apache-2.0
// Tracks the OpenCV images of a camera of one's own, and prints the pose of each frame.
//
//   03_own_camera CAMERA.yaml ASSOCIATIONS.txt
//
// CAMERA.yaml holds the intrinsics; images of a distorted camera are rectified. The images come
// from files here, so that the example needs no device: each line of ASSOCIATIONS.txt has the time
// and the name of a color image and of a depth image, relative to the folder of the list.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <stillmap/base/error.hpp>
#include <stillmap/sensor/make_source.hpp>
#include <stillmap/slam.hpp>
#include <string>

#include <opencv2/imgcodecs.hpp>

namespace {

int run(const std::string& camera_file, const std::filesystem::path& list) {
  stillmap::Slam slam(stillmap::read_camera(camera_file), stillmap::read_options("fused"));
  std::ifstream lines(list);
  for (std::string line; std::getline(lines, line);) {
    double timestamp = 0, depth_timestamp = 0;
    std::string color_name, depth_name;
    if (!(std::istringstream(line) >> timestamp >> color_name >> depth_timestamp >> depth_name))
      continue;
    const cv::Mat color = cv::imread((list.parent_path() / color_name).string());
    const cv::Mat depth =
        cv::imread((list.parent_path() / depth_name).string(), cv::IMREAD_UNCHANGED);
    const stillmap::PoseUpdate update = slam.push(color, depth, timestamp);
    if (update.T_world_camera) {
      std::cout << timestamp << ' ' << update.T_world_camera->translation().transpose() << '\n';
    } else {
      std::cerr << timestamp << ": " << update.reason << '\n';
    }
  }
  const stillmap::Results results = slam.finish();
  return results.statistics.tracked > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 03_own_camera CAMERA.yaml ASSOCIATIONS.txt\n";
    return EXIT_FAILURE;
  }
  try {
    return run(argv[1], argv[2]);
  } catch (const stillmap::Error& e) {
    std::cerr << e.what() << '\n';
    return EXIT_FAILURE;
  }
}
