// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// A recording on which the papers' experiments are repeated.
struct BenchmarkSequence {
  std::string name;  ///< Name as returned by benchmark_name().
  std::filesystem::path folder;
  std::string camera;       ///< Camera preset, if the folder has no camera.yaml; may be empty.
  std::string truth_frame;  ///< "bonn", if the truth is the pose of a marker; otherwise empty.
};

/// Returns the name of the sequence in a folder of this name: that in the papers' tables for a
/// dynamic sequence of TUM freiburg3 in the benchmark's or a short spelling
/// (rgbd_dataset_freiburg3_walking_xyz, fr3_w_xyz: walking_xyz); fr1_rpy; bonn_NAME for the Bonn
/// RGB-D Dynamic Dataset; kitchen_NAME and yard_NAME as they are. Empty for any other folder.
std::string benchmark_name(const std::string& folder);

/// Returns the recordings in a folder: the papers' sequences first, in the order of their tables,
/// then the others by name. Recordings without images or ground truth are not returned.
/// @param names  sequences wanted, by benchmark_name() or by the name of their folder, which then
/// need not be a known one; empty: all known ones
/// Throws Error if the folder does not exist, or does not have a sequence that `names` wants.
std::vector<BenchmarkSequence> find_benchmark_sequences(const std::filesystem::path& folder,
                                                        const std::vector<std::string>& names = {});

/// Returns where a sequence of the papers comes from: its name in the benchmark and the page to
/// download it from.
std::string download_hint(const std::string& name);

}  // namespace stillmap
