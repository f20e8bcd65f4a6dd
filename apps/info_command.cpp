// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/recording/recording.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

struct InfoArguments {
  std::string file, camera, topics;
};

double rate_of(const Topic& topic) {
  const double span = seconds_of(topic.last_time - topic.first_time);
  return topic.messages > 1 && span > 0 ? static_cast<double>(topic.messages - 1) / span : 0;
}

void print_topics(const Recording& recording) {
  std::size_t width = 5;
  for (const Topic& topic : recording.topics()) width = std::max(width, topic.name.size());
  print_out("{:<{}}  {:>8}  {:>8}  type\n", "topic", width, "messages", "Hz");
  for (const Topic& topic : recording.topics()) {
    print_out(
        "{:<{}}  {:>8}  {:>8.2f}  {}{}\n", topic.name, width, topic.messages, rate_of(topic),
        topic.type,
        topic.encoding == "ros1" || topic.encoding == "cdr" ? "" : " (" + topic.encoding + ")");
  }
}

void print_camera(const Camera& camera) {
  print_out("camera: {} x {} pixels, focal length {:.1f}, sensor {}, depth factor {:g}\n",
            camera.width, camera.height, camera.fx, camera.depth_sensor.name, camera.depth_factor);
}

int run(const InfoArguments& arguments) {
  SourceOptions options;
  options.camera = arguments.camera;
  options.topics = arguments.topics;
  const std::filesystem::path path = arguments.file;
  const bool recorded = is_recording(path) && !std::filesystem::exists(path / "rgb.txt");
  if (recorded) {
    Recording recording(arguments.file);
    print_out("{}: {:.2f} s, {}\n", arguments.file, recording.duration(),
              counted(recording.topics().size(), "topic"));
    print_topics(recording);
  }
  const auto source = make_source(arguments.file, options);
  for (const std::string& note : source->notes()) print_out("{}\n", note);
  if (!recorded) print_camera(source->camera());  // of a recording, a note tells it
  print_out("frames: {}\n", source->size().value_or(0));
  return print_findings(source->findings());
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command =
      app.add_subcommand("info", "list the topics, cameras and frames of a recording");
  command
      ->add_option("file", arguments->file,
                   "recording, as for run: ROS 1 bag, recording of rosbag2 (.db3, .mcap, or their "
                   "folder), folder of images, stereo pair")
      ->required();
  command->add_option("--camera", arguments->camera,
                      "preset name or file of the color camera; default: that of the recording");
  command->add_option("--topics", arguments->topics,
                      "COLOR,DEPTH or, of a stereo pair, LEFT,RIGHT: the topics that run shall "
                      "use; default: color and depth by type, encoding and name");
  command->footer(
      "Example:\n  stillmap info recorded.mcap\nExit code 1 if the recording cannot be mapped as "
      "it is.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
