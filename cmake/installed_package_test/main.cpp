// SPDX-License-Identifier: Apache-2.0
// Maps a gray frame with the network named on the command line, writes the results to the folder
// named after it, and prints the network's description.
#include "stillmap/base/error.hpp"
#include "stillmap/segment/detector.hpp"
#include "stillmap/write_results.hpp"

#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  stillmap::Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 140;
  camera.cx = 80;
  camera.cy = 60;
  try {
    auto detector = stillmap::make_detector(argv[1]);
    std::cout << detector->description() << '\n';
    stillmap::Slam slam(camera, {}, std::move(detector));
    slam.push(cv::Mat(120, 160, CV_8UC3, cv::Scalar::all(128)),
              cv::Mat(120, 160, CV_32FC1, cv::Scalar(2)), 0);
    stillmap::write_results(slam.finish(), argv[2]);
  } catch (const stillmap::Error& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
}
