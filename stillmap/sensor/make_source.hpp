// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace stillmap {

/// Returns the camera of a preset (camera_presets(); also TUM1, TUM2, TUM3) or of a file:
/// - our YAML format: name, width, height, fx, fy, cx, cy, distortion [k1, k2, p1, p2, k3],
///   depth_factor, fps, baseline, sensor (a name that find_depth_sensor() knows), readout and
///   depth_delay (ShutterTiming), disparity_offset and disparity_bow (DisparityBias), ignore
///   (Camera::ignore, relative to the camera file). Name, distortion, fps, baseline, sensor,
///   timing, disparity bias and ignore are optional;
///   the default sensor is kinect_v1, the default baseline that of a triangulating sensor;
/// - settings of ORB-SLAM, OpenVSLAM and stella_vslam (Camera.fx ...); keys that do not concern the
///   camera are ignored;
/// - camera_info of ROS as YAML, a camera of RTAB-Map, YAML or XML of OpenCV's FileStorage;
/// - files of Open3D, librealsense, Kalibr, VINS, NICE-SLAM, nerfstudio, instant-ngp, Record3D,
///   ARKitScenes and Stray Scanner: docs/cameras.md describes how each is recognized, and the depth
///   factor of files without one (mostly millimeters).
///
/// Throws Error with file, key and fix for an unknown name, a missing, repeated, misspelled or
/// mistyped key, and an impossible value (focal length or depth factor not positive, principal
/// point outside the image, a number that is not finite), for a file without the size of the
/// images, and for a lens that is not known or of which Brown's model with five coefficients, which
/// is fitted to it, differs by more than 0.25 pixels (rational, RealSense's inverse, equidistant).
Camera read_camera(const std::string& name_or_file);

/// When to stop waiting for the next image of a folder that still grows or of a live camera.
struct Following {
  double patience = 5;  ///< Time without a new frame [s].
  /// Returns whether the user wants to end; may be empty.
  std::function<bool()> stop = {};
};

/// Part of a recording to use, and settings that the recording does not contain.
struct SourceOptions {
  /// Preset name or file, as for read_camera(); empty for the recording's own camera.yaml.
  std::string camera;
  /// Camera of the recorded images; if given, `camera` is not used.
  std::optional<Camera> recorded = {};
  /// Replaces Camera::ignore, also of a camera in the recording; empty: not replaced.
  std::string ignore = {};
  /// The topics of a recorded file to use, "COLOR,DEPTH" or, of a stereo pair, "LEFT,RIGHT"; empty
  /// to choose color and depth by type, encoding and name.
  std::string topics = {};
  std::string associations;  ///< File that pairs color and depth images; empty for the lists.
  double fps = 30;           ///< Rate of images whose names are numbers, not times [Hz].
  int first = 0;             ///< Number of frames skipped at the start.
  int count = 0;             ///< Maximum number of frames used, counted before the stride; 0: all.
  int stride = 1;            ///< Interval of the frames used; 1: every frame.
  int rotate = 0;            ///< Turns the images clockwise by 0, 90, 180 or 270 degrees.
  bool half_size = false;    ///< Reduces images to half their width and height.
  /// Given: the folder still grows, and the source waits for further images.
  std::optional<Following> following = {};
};

/// Returns the source of frames that a text names:
/// - "FILE", a ROS 1 bag or a file of rosbag2 (.db3, .mcap), or a folder with such files;
/// - "FOLDER" or "tum:FOLDER", a recording in the layout of the TUM RGB-D benchmark (rgb/, depth/,
///   rgb.txt, depth.txt, and camera.yaml) or in another one that docs/cameras.md lists;
/// - "realsense:" or "realsense:SERIAL", a live camera, if Stillmap was built with librealsense.
///   Its frames are dropped, and listed in skipped(), if they are not taken in time.
/// Throws Error that lists the known forms for any other text, and if the source cannot be used.
std::unique_ptr<FrameSource> make_source(const std::string& text,
                                         const SourceOptions& options = {});

/// Returns whether a source is a folder of color and depth images: no live camera, recorded file or
/// stereo pair.
bool names_image_folder(const std::string& text);

/// Returns whether the text names a camera instead of a recording.
bool names_live_camera(const std::string& text);

/// Returns the camera of the recorded images, with which make_source() would make frames. Throws
/// Error if there is none.
Camera recorded_camera(const std::string& text, const SourceOptions& options = {});

/// Returns the file with the true trajectory (groundtruth.txt) in the folder of a recording; empty
/// if there is none.
std::filesystem::path true_trajectory_file(const std::string& text);

}  // namespace stillmap
