// SPDX-License-Identifier: Apache-2.0
// Loads the network named on the command line, shows it a gray frame, and prints its description.
#include "stillmap/base/error.hpp"
#include "stillmap/segment/make_detector.hpp"

#include <iostream>

int main(int argc, char** argv) {
  stillmap::RgbdFrame frame;
  frame.color = cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(128));
  frame.gray = cv::Mat(48, 64, CV_8UC1, cv::Scalar(128));
  frame.depth = cv::Mat(48, 64, CV_32FC1, cv::Scalar(2));
  try {
    const auto detector = stillmap::make_detector(argc > 1 ? argv[1] : "");
    if (!detector->detect(frame).empty()) return 1;
    std::cout << detector->description() << '\n';
  } catch (const stillmap::Error& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
}
