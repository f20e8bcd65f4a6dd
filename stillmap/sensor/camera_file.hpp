// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the names of the camera presets: tum_fr1, tum_fr2, tum_fr3 (TUM RGB-D benchmark, Sturm
/// et al., IROS 2012; intrinsics as published) and kitchen (a Kinect with a focal length of 528
/// pixels).
const std::vector<std::string>& camera_presets();

/// Loads a camera by preset name or from a file:
/// - our YAML format (see write_camera()): name, width, height, fx, fy, cx, cy,
///   distortion [k1, k2, p1, p2, k3], depth_factor, fps, baseline, sensor (a name that
///   find_depth_sensor() knows), readout and depth_delay (ShutterTiming). Name, distortion, fps,
///   baseline, sensor and timing are optional; the default sensor is kinect_v1, the default
///   baseline that of a triangulating sensor;
/// - an ORB-SLAM settings file: `%YAML:1.0`, Camera.fx or Camera1.fx ..., Camera.k1 ...,
///   Camera.width, Camera.fps, Camera.bf or Stereo.b, DepthMapFactor or RGBD.DepthMapFactor. All
///   other keys of such a file (matrices, ORBextractor.*, Viewer.*) are ignored.
///
/// Throws Error with file, key and fix for an unknown name, a missing, repeated, misspelled or
/// mistyped key, and an impossible value (focal length or depth factor not positive, principal
/// point outside the image, a number that is not finite, a fisheye model).
Camera load_camera(const std::string& name_or_path);

/// Writes a camera as YAML; load_camera() returns the same camera. Throws Error if the file cannot
/// be written.
void write_camera(const std::filesystem::path& file, const Camera& camera);

/// Throws Error (naming `where`) for impossible values: see load_camera().
void check_camera(const Camera& camera, const std::string& where);

}  // namespace stillmap
