// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/measured_speed.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

struct SpeedArguments {
  std::string sequence, folder, camera;
};

/// Measures how fast the masked objects of a sequence move, as truth for later evaluations.
void measure(const SpeedArguments& arguments) {
  const SequencePaths paths = find_sequence(arguments.sequence);
  if (paths.masks.empty() || paths.ground_truth.empty()) {
    throw Error("the sequence has no mask/ folder or no groundtruth.txt", arguments.sequence,
                "both are needed to measure the speed of objects in the world");
  }
  TumFolder source(
      paths, read_camera(arguments.camera.empty() ? paths.camera.string() : arguments.camera));
  const std::size_t written = write_speeds(source, StampedImages(paths.masks),
                                           read_trajectory(paths.ground_truth), arguments.folder);
  fmt::print("written: {} ({} images)\n", arguments.folder, written);
}

}  // namespace

void add_speeds_command(CLI::App& app) {
  auto arguments = std::make_shared<SpeedArguments>();
  CLI::App* command = app.add_subcommand(
      "speeds", "measure the speed of every masked pixel from images, depth, masks and true poses");
  command->add_option("sequence", arguments->sequence, "folder in TUM layout with mask/ and truth")
      ->required();
  command
      ->add_option("out", arguments->folder, "folder for `stillmap eval --speeds`; must not exist")
      ->required();
  command->add_option("--camera", arguments->camera,
                      "camera preset or file; default: SEQUENCE/camera.yaml");
  command->callback([arguments] { measure(*arguments); });
}

}  // namespace stillmap::lab
