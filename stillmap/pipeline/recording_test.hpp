// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

/// Small rendered sequences with known poses, for the tests of this room.
namespace stillmap::recorded {

/// Sequences are rendered once and kept: several tests run on the same pictures.
struct Recording {
  std::shared_ptr<const SimulatedSequence> sequence;
  std::vector<RgbdFramePtr> frames;
};

inline const Recording& recording(int people, const std::string& camera,
                                  const std::string& sensor = "kinect_v1") {
  static std::map<std::tuple<int, std::string, std::string>, Recording> made;
  Recording& r = made[{people, camera, sensor}];
  if (!r.sequence) {
    SimulationOptions options;
    options.people = people;
    options.camera = camera;
    options.sensor = sensor;
    options.frames = 90;
    options.width = 320;
    options.height = 240;
    r.sequence = std::make_shared<SimulatedSequence>(options);
    for (std::size_t i = 0; i < r.sequence->frames(); ++i) r.frames.push_back(r.sequence->frame(i));
  }
  return r;
}

inline SlamParameters small_options(const std::string& preset) {
  Options options = read_options(preset);
  options.features.keypoints = 600;
  return parameters_of(options);
}

/// A new image (cv::Mat::zeros would be written into the recording's own).
inline cv::Mat black(const cv::Mat& like) {
  return cv::Mat(like.size(), like.type(), cv::Scalar::all(0));
}

inline bool same_bytes(const Trajectory& a, const Trajectory& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const auto& x, const auto& y) {
           return x.timestamp == y.timestamp &&
                  x.T_world_camera.translation() == y.T_world_camera.translation() &&
                  x.T_world_camera.quaternion().coeffs() == y.T_world_camera.quaternion().coeffs();
         });
}

}  // namespace stillmap::recorded
