// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// What a TUM RGB-D folder holds. Empty paths where a thing is not there.
struct SequencePaths {
  std::filesystem::path folder;
  std::filesystem::path color_list, depth_list;  ///< rgb.txt and depth.txt: `timestamp file` a line
  /// `t_rgb rgb_file t_depth depth_file` a line; where not empty, used instead of the two lists.
  std::filesystem::path associations;
  std::filesystem::path camera;        ///< camera.yaml: see load_camera
  std::filesystem::path ground_truth;  ///< groundtruth.txt: see read_trajectory
  std::filesystem::path masks;         ///< mask/: one 8-bit PNG per color image, of its name
};

/// Looks at a folder. The two lists are preferred; associations.txt (or associate.txt,
/// association.txt) is taken where one of them is missing, or where `associations` names a file.
/// Throws Error that says what is missing and what to do: no such folder, an archive or a bag in
/// its place, a folder above or below the sequence, lists missing.
SequencePaths find_sequence(const std::filesystem::path& folder,
                            const std::filesystem::path& associations = {});

/// One color image and the depth image recorded with it.
struct FrameFiles {
  double timestamp = 0;        ///< seconds, of the color image
  double depth_timestamp = 0;  ///< seconds
  std::filesystem::path color, depth;
};

/// The frames that the lists promise (stamps increase strictly) and the lines that give none.
struct FrameList {
  std::vector<FrameFiles> frames;
  std::vector<SkippedFrame> skipped;
};

/// Reads the lists and pairs them by TUM's rule (associate()), or reads the associations file.
/// Blanks, tabs or commas between the fields; # starts a comment; either line ending. Lines that
/// are none, stamps that are not finite, repeat or run backwards (the fewest lines are given up
/// that leave the rest increasing), and color images without depth are skipped and told. No image
/// is opened. Throws Error: a list that cannot be read or contains no line of its kind; no pair at
/// all.
FrameList list_frames(const SequencePaths& paths);

}  // namespace stillmap
