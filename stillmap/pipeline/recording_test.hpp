// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/segment/mask_folder.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

/// Small rendered sequences with known poses, for the tests of this module.
namespace stillmap::recorded {

/// A rendered sequence. Each is rendered once, since several tests use the same images.
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

/// Returns a person whose mask covers the whole image of the frame.
inline Instance person_everywhere(const RgbdFrame& frame) {
  Instance person;
  person.class_name = "person";
  person.box = cv::Rect({}, frame.gray.size());
  person.mask = cv::Mat(frame.gray.size(), CV_8UC1, cv::Scalar(255));
  return person;
}

inline bool same_bytes(const Trajectory& a, const Trajectory& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const auto& x, const auto& y) {
           return x.timestamp == y.timestamp &&
                  x.T_world_camera.translation() == y.T_world_camera.translation() &&
                  x.T_world_camera.quaternion().coeffs() == y.T_world_camera.quaternion().coeffs();
         });
}

/// A detector that knows the true masks of a rendered sequence.
class TrueMasks final : public Detector {
 public:
  explicit TrueMasks(std::shared_ptr<const SimulatedSequence> sequence)
      : sequence_(std::move(sequence)) {}
  std::vector<Instance> detect(const RgbdFrame& frame) override {
    return instances_of_mask(class_mask(sequence_->truth(frame.index)));
  }
  std::string description() const override { return "true masks"; }
  const std::vector<std::string>& class_names() const override { return names_; }

 private:
  std::shared_ptr<const SimulatedSequence> sequence_;
  std::vector<std::string> names_ = {"person", "unknown"};
};

/// Returns the depths of the points that are in view of the first frame, minus the true depth of
/// their pixels [m]. Points nearer than 0.3 m and pixels without depth are left out.
inline std::vector<double> depth_errors(const Cloud& cloud, const Recording& recording,
                                        const Pose& T_camera_world) {
  const TruthFrame truth = recording.sequence->truth(0);
  const Camera& camera = recording.sequence->camera();
  std::vector<double> errors;
  for (const Eigen::Vector3f& point : cloud.points) {
    const Eigen::Vector3d p = T_camera_world * point.cast<double>();
    if (p.z() < 0.3) continue;
    const Eigen::Vector2d uv = camera.project(p);
    if (!camera.contains(uv.x(), uv.y(), 1)) continue;
    const double depth =
        truth.depth.at<float>(static_cast<int>(uv.y() + 0.5), static_cast<int>(uv.x() + 0.5));
    if (depth > 0) errors.push_back(p.z() - depth);
  }
  return errors;
}

}  // namespace stillmap::recorded
