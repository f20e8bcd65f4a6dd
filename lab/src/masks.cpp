// SPDX-License-Identifier: Apache-2.0
// Writes the masks of people that a network finds in every frame of a recording, for other
// programs: one PNG per frame, named by its time stamp, 255 on people, in the pixels of the
// rectified frames.
#include "stillmap/segment/detector.hpp"
#include "stillmap/segment/dynamic_mask.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <filesystem>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

struct MasksArguments {
  std::string source, out, model;
  SourceOptions options;
};

void write_masks(const MasksArguments& arguments) {
  const auto source = make_source(arguments.source, arguments.options);
  const auto detector = make_detector(arguments.model);
  std::filesystem::create_directories(arguments.out);
  std::size_t frames = 0;
  for (auto frame = source->next(); frame; frame = source->next(), ++frames) {
    write_png(std::filesystem::path(arguments.out) / fmt::format("{:.6f}.png", frame->timestamp),
              dynamic_mask({frame->index, frame->index, detector->detect(*frame)}, {"person"},
                           frame->gray.size()));
  }
  fmt::print("{} masks\n", frames);
}

}  // namespace

void add_masks_command(CLI::App& app) {
  auto arguments = std::make_shared<MasksArguments>();
  CLI::App* command =
      app.add_subcommand("masks", "write the masks of people in every frame of a recording");
  command->add_option("source", arguments->source, "recorded file or folder of images")->required();
  command->add_option("out", arguments->out, "folder for the masks")->required();
  command->add_option("--model", arguments->model, "network (.onnx)")->required();
  command->add_option("--camera", arguments->options.camera, "camera preset or file");
  command->callback([arguments] { write_masks(*arguments); });
}

}  // namespace stillmap::lab
