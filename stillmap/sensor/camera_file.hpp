// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Names that load_camera knows without a file: tum_fr1, tum_fr2, tum_fr3 (TUM RGB-D benchmark,
/// Sturm et al., IROS 2012; the intrinsics its authors calibrated) and kitchen (a Kinect at 528
/// pixels).
const std::vector<std::string>& camera_presets();

/// A camera by preset name, or from a file:
/// - our own YAML (what write_camera writes): name, width, height, fx, fy, cx, cy,
///   distortion [k1, k2, p1, p2, k3], depth_factor, fps, baseline. Name, distortion, fps and
///   baseline may be left out;
/// - the settings file of an ORB-SLAM user: `%YAML:1.0`, Camera.fx or Camera1.fx ...,
///   Camera.k1 ..., Camera.width, Camera.fps, Camera.bf or Stereo.b, DepthMapFactor or
///   RGBD.DepthMapFactor. Everything else in such a file (matrices, ORBextractor.*, Viewer.*) is
///   left alone.
///
/// Throws Error that names the file, the key and the fix: an unknown name, a missing, repeated,
/// misspelled or mistyped key, a value that no camera has (focal length or depth factor not
/// positive, principal point outside the image, a number that is not finite, a fisheye model).
Camera load_camera(const std::string& name_or_path);

/// Writes a camera as our own YAML; load_camera gives back the same. Throws Error if it cannot be
/// written.
void write_camera(const std::filesystem::path& file, const Camera& camera);

/// Throws Error (naming `where`) if the values are no camera's: see load_camera.
void check_camera(const Camera& camera, const std::string& where);

}  // namespace stillmap
