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
  std::string associations;  ///< file that pairs color and depth images; empty for the lists
  int first = 0;             ///< number of frames skipped at the start
  int count = 0;             ///< maximum number of frames used, counted before the stride; 0: all
  int stride = 1;            ///< every n-th frame is used
  bool half_size = false;    ///< whether images are processed at half their width and height
};

/// Makes the source of frames that a text names: "FOLDER" or "tum:FOLDER", a recording in the
/// layout of the TUM RGB-D benchmark (rgb/, depth/, rgb.txt, depth.txt, and camera.yaml). Throws
/// Error that lists the known forms for any other text, and if the source cannot be used.
std::unique_ptr<FrameSource> make_source(const std::string& text,
                                         const SourceOptions& options = {});

}  // namespace stillmap
