// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/slam_system.hpp"

#include <memory>

/// Shows two frames without a single corner to the façade: it must take them, and find no pose.
int main() {
  const stillmap::Camera camera;
  stillmap::SlamSystem slam(camera, {});
  for (std::size_t index = 0; index < 2; ++index) {
    auto frame = std::make_shared<stillmap::RgbdFrame>();
    frame->index = index;
    frame->timestamp = static_cast<double>(index) / camera.fps;
    frame->color = cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar::all(128));
    frame->gray = cv::Mat(camera.height, camera.width, CV_8UC1, cv::Scalar(128));
    frame->depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(2));
    if (slam.push(frame)) return 1;
  }
  const stillmap::SlamResult result = slam.finish();
  return result.frames.size() == 2 && result.tracked() == 0 ? 0 : 1;
}
