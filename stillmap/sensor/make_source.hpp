// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <memory>
#include <string>

namespace stillmap {

/// Part of a recording to use, and settings that the recording does not contain.
struct SourceOptions {
  /// Preset name (tum_fr1, tum_fr2, tum_fr3, kitchen), camera.yaml or an ORB-SLAM settings file;
  /// empty for the recording's own camera.yaml.
  std::string camera;
  std::string associations;  ///< File that pairs color and depth images; empty for the lists.
  int first = 0;             ///< Number of frames skipped at the start.
  int count = 0;             ///< Maximum number of frames used, counted before the stride; 0: all.
  int stride = 1;            ///< Interval of the frames used; 1: every frame.
  bool half_size = false;    ///< Reduces images to half their width and height.
};

/// Returns the source of frames that a text names: "FOLDER" or "tum:FOLDER", a recording in the
/// layout of the TUM RGB-D benchmark (rgb/, depth/, rgb.txt, depth.txt, and camera.yaml). Throws
/// Error that lists the known forms for any other text, and if the source cannot be used.
std::unique_ptr<FrameSource> make_source(const std::string& text,
                                         const SourceOptions& options = {});

}  // namespace stillmap
