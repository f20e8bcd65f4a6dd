// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_map.hpp"
#include "stillmap/evaluate/report.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include "result_files.hpp"
#include <CLI/CLI.hpp>

namespace stillmap {

/// Which files are made of a dense map besides its cloud.
struct DenseOutputs {
  std::vector<std::string> mesh;  ///< extensions: ply, obj, glb; empty: no mesh
  bool planner = false;           ///< octomap.bt, grid.pgm and grid.yaml, obstacles.json(l)
  bool any() const { return planner || !mesh.empty(); }
};

/// Adds --mesh and --planner to a command.
void add_dense_options(CLI::App& command, DenseOutputs& outputs);

/// One line for each file that they make, for a command's help.
std::string dense_files_help();

/// Throws Error for an extension that no mesh is written in.
void check(const DenseOutputs& outputs);

/// Throws Error if the file cannot be written.
void write_png(const std::filesystem::path& file, const cv::Mat& picture);

/// What of a run goes into the files besides the map.
struct DenseContext {
  Trajectory trajectory;     ///< tells what is up, and where pictures are taken from
  std::string movers_jsonl;  ///< text of movers.jsonl, for the obstacles; may be empty
};

/// Writes cloud.ply and what is wished for into a folder: semantic.ply,
/// semantic_classes.ply, semantic_legend.png and objects.json where a network found things,
/// mesh.*, and the planner's files. Each goes through `files`.
/// @returns pictures of the cloud, the classes and the mesh, for the report
std::vector<ReportImage> write_dense(const std::filesystem::path& out, const ComposedCloud& cloud,
                                     const PlacedMap& placed, const DenseContext& context,
                                     const DenseOptions& options, const DenseOutputs& outputs,
                                     ResultFiles& files);

}  // namespace stillmap
