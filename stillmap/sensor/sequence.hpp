// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// How a folder names and pairs its images.
enum class FolderLayout {
  kLists,        ///< Lists of images (TUM, Bonn, OpenLORIS), or a file of associations (ICL-NUIM).
  kSevenScenes,  ///< frame-000000.color.png and frame-000000.depth.png in one folder.
  kReplica,      ///< results/frame000000.jpg and results/depth000000.png (NICE-SLAM's Replica).
  kFolders       ///< A folder of color and one of depth images, without lists.
};

/// Files of a folder with color and depth images; paths of missing files are empty.
struct SequencePaths {
  FolderLayout layout = FolderLayout::kLists;
  /// Folders of the color and depth images, for layouts without lists.
  std::filesystem::path color_folder, depth_folder;
  double fps = 30;  ///< Rate of images whose names are numbers, not times [Hz].
  /// Whether more images are written: frames whose images may be incomplete, or whose depth image
  /// may still come, are not listed.
  bool growing = false;
  std::filesystem::path folder;
  /// rgb.txt (or color.txt) and depth.txt (or aligned_depth.txt) with lines `timestamp file`.
  std::filesystem::path color_list, depth_list;
  /// Lines `t_rgb rgb_file t_depth depth_file`; if not empty, used instead of the two lists.
  std::filesystem::path associations;
  /// camera.yaml, or the camera file of the program that wrote the folder: see read_camera().
  std::filesystem::path camera;
  std::filesystem::path ground_truth;  ///< File of true poses: see true_trajectory_in().
  std::filesystem::path masks;  ///< Folder mask/: one 8-bit PNG per color image with the same name.
};

/// Returns the file of true poses in a folder, for read_trajectory(): groundtruth.txt, traj.txt
/// (Replica) or lowres_wide.traj (ARKitScenes); empty if there is none.
std::filesystem::path true_trajectory_in(const std::filesystem::path& folder);

/// Finds the files of a sequence. The two lists are preferred; associations.txt (or associate.txt,
/// association.txt) is used if one of them is missing, or if `associations` is given; without any
/// of these the images of a folder pair rgb (color, image) and depth, or of another layout that
/// docs/cameras.md lists.
/// Throws Error with the problem and the fix: a missing folder, an archive or bag instead of a
/// folder, a folder above or below the sequence, missing lists.
SequencePaths find_sequence(const std::filesystem::path& folder,
                            const std::filesystem::path& associations = {});

/// One color image and its depth image, if it has one.
struct FrameFiles {
  double timestamp = 0;  ///< Time of the color image [s].
  double depth_timestamp =
      0;  ///< Time of the depth image [s]; that of the color image without one.
  std::filesystem::path color;  ///< File of the color image.
  std::filesystem::path depth;  ///< File of the depth image; empty: the frame has no depth.
};

/// The frames of the lists (with strictly increasing timestamps) and the skipped lines.
struct FrameList {
  std::vector<FrameFiles> frames;
  std::vector<SkippedFrame> skipped;
};

/// Reads the lists and associates them by TUM's rule (associate()), or reads the associations file,
/// whose stamps may be the numbers of the frames (ICL-NUIM: both are whole numbers below 1e6).
/// Color and depth are exchanged if their first files are a depth and a color image. Stamps in
/// milli-, micro- or nanoseconds since 1970 are converted: see unit_of_stamps(). Names of images
/// without lists are times in seconds (with a decimal point), in nano-, micro- or milliseconds (19,
/// 16 or 13 digits), or numbers: see frame_times(). Fields are separated by blanks, tabs or commas;
/// file names may contain blanks; # starts a comment; any line endings; UTF-8 or UTF-16. Invalid
/// lines, timestamps that are not finite, repeated or decreasing (the smallest number of lines is
/// skipped that leaves the rest increasing), and color images before the first depth image are
/// skipped and listed. Later color images without a depth image of their own become frames without
/// depth. Only the headers of the first images are read. Throws Error for an unreadable list, a
/// list without valid lines, and if there is no pair.
FrameList list_frames(const SequencePaths& paths);

}  // namespace stillmap
