// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <string>

namespace stillmap {

/// Relation of a recorded ground truth, the pose of a tracked body (a marker, a robot), to the pose
/// of the camera: T_world_camera = T_world_reference * T_reference_body * T_body_camera.
struct TruthFrame {
  Pose T_world_reference;  ///< Change of the world frame; has no influence on aligned errors.
  Pose T_body_camera;      ///< Pose of the camera in the frame of the tracked body [m].
};

/// Returns the named relation: "bonn" (the Bonn RGB-D Dynamic Dataset: marker body of the motion
/// capture system, from the evaluation script that Palazzolo et al. 2019 publish with it), or that
/// in a file: T_body_camera as 4 x 4 numbers separated by blanks or lines, # starts a comment. A
/// uniform scale of the rotation is removed, as calibrations of a marker against a depth image
/// contain one. Throws Error for an unknown file, another number of values, or a matrix that is no
/// rotation up to scale (by more than 5 %).
TruthFrame read_truth_frame(const std::string& name);

/// Returns the poses of the camera from those of the tracked body.
Trajectory in_camera_frame(const Trajectory& body, const TruthFrame& frame);

}  // namespace stillmap
