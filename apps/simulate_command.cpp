// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/simulate/camera_motion.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/simulate/tum_writer.hpp"

#include "command_tree.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#include "progress.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

struct SimulateArguments {
  SimulationOptions options;
  std::string out = "simulated";
  bool no_noise = false;
};

int run(const SimulateArguments& arguments) {
  SimulationOptions options = arguments.options;
  options.noise = !arguments.no_noise;
  if (arguments.no_noise) options.sensor = "ideal";
  make_output_folder(arguments.out);
  catch_interrupt();
  const SimulatedSequence sequence(options);
  const std::size_t frames = [&] {
    Progress progress("rendering", sequence.frames());
    return write_tum_layout(sequence, arguments.out, [&](std::size_t) {
      progress.step();
      return !interrupted();
    });
  }();
  if (frames < sequence.frames())
    print_out("interrupted after {} of {}\n", frames, counted(sequence.frames(), "frame"));
  print_out("written: {} ({}; map it with: stillmap run {})\n", arguments.out,
            counted(frames, "frame"), arguments.out);
  return frames < sequence.frames() ? kInterrupted : kSuccess;
}

void add_sensor_options(CLI::App& command, SimulateArguments& arguments) {
  SimulationOptions& o = arguments.options;
  command
      .add_option("--readout", o.readout,
                  "rolling shutter of the color camera: time from first to last row [s]")
      ->capture_default_str();
  command
      .add_option("--depth-delay", o.depth_delay,
                  "time from the color image to the depth image [s], not in its timestamp")
      ->capture_default_str();
  command
      .add_option("--disparity-offset", o.depth_bias.offset,
                  "systematic error of the depth [pixels of disparity]")
      ->capture_default_str();
  command
      .add_option("--disparity-bow", o.depth_bias.bow,
                  "the same, growing to this value in the corners of the image [pixels]")
      ->capture_default_str();
  command
      .add_option("--auto-exposure", o.color_noise.auto_exposure,
                  "strength of the automatic exposure [0..1]")
      ->capture_default_str();
  command
      .add_option("--imu", o.imu,
                  "inertial measurement unit on the camera, by its noise and biases")
      ->type_name(fmt::format("{{{}}}", fmt::join(imu_names(), ",")));
  command.add_flag("--wheels", o.wheels, "odometry of wheels that carry the camera");
  CLI::Option* sensor =
      command.add_option("--sensor", o.sensor, "depth sensor, by its noise, range and holes")
          ->type_name(fmt::format("{{{}}}", fmt::join(depth_sensor_names(), ",")))
          ->capture_default_str();
  command
      .add_flag("--no-noise", arguments.no_noise,
                "exact depth of sensor ideal, and color without noise")
      ->excludes(sensor);
}

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<SimulateArguments>();
  SimulationOptions& o = arguments->options;
  CLI::App* command =
      app.add_subcommand("simulate", "render an RGB-D sequence with known poses, masks and movers");
  command
      ->add_option(
          "--scene", o.scene,
          "scene: office (one room), flat (four rooms, a path of 60 m) or yard (containers "
          "below a bridge crane; its objects are the swinging hook and two vehicles)")
      ->type_name("{office,flat,yard}")
      ->capture_default_str();
  command->add_option("--people", o.people, "number of people")->capture_default_str();
  command
      ->add_option(
          "--activity", o.activity,
          "activity of the people; rise: sits four seconds, then gets up and walks; "
          "companion: walks ahead of --camera follow; crowd: --people 4 or more pass close "
          "in front of the camera")
      ->type_name("{walk,sit,wave,mixed,rise,companion,crowd}")
      ->capture_default_str();
  command->add_option("--objects", o.things, "number of moving objects of no known class")
      ->capture_default_str();
  command->add_flag(
      "--near-objects", o.near_things,
      "moving objects are close to the camera, in its view; in the yard the hook carries a load "
      "that fills a third of the view");
  // The former names of the two options.
  command->add_option("--things", o.things)->group("");
  command->add_flag("--near-things", o.near_things)->group("");
  command
      ->add_option(
          "--camera", o.camera,
          "camera motion; trolley: below the crane of the yard, a rectangle out and back in "
          "35 s, looking ahead and down; FILE: along this trajectory (TUM format), from the place "
          "and view of xyz on")
      ->type_name(names_or_file(camera_motion_names()))
      ->capture_default_str();
  command
      ->add_option("--visit", o.visit,
                   "visit of the office: at the second one some furniture has been moved, removed "
                   "or added (rearranged.csv)")
      ->type_name("{1,2}")
      ->capture_default_str();
  command
      ->add_option("--light", o.light,
                   "light; evening: every other lamp and the window are dark, and there is less "
                   "light from the walls")
      ->type_name("{day,evening}")
      ->capture_default_str();
  command
      ->add_option(
          "--tags", o.tags,
          "number of AprilTags of family tag36h11, ids from 0, with a side of 0.2 m, on walls "
          "(up to 12) or on the yard's containers (up to 9); their corners: tags.csv")
      ->capture_default_str();
  command->add_option("--frames", o.frames, "number of frames")->capture_default_str();
  command->add_option("--fps", o.fps, "frames per second")->capture_default_str();
  command->add_option("--width", o.width, "image width [pixels]")->capture_default_str();
  CLI::Option* height =
      command->add_option("--height", o.height, "image height [pixels]")->capture_default_str();
  command
      ->add_option("--camera-model", o.camera_model,
                   "use intrinsics and depth sensor of this camera, scaled to --width")
      ->type_name(names_or_file(camera_presets()))
      ->excludes(height);
  command->add_option("--seed", o.seed, "seed of scene, hand shake and noise")
      ->capture_default_str();
  command->add_option("--shake", o.shake, "factor on the shake of the hand; 0: a tripod")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--speed", o.speed, "factor on the speed of the camera motion")
      ->capture_default_str();
  command->add_option("--exposures", o.exposures, "images averaged for motion blur; 1: no blur")
      ->capture_default_str();
  add_sensor_options(*command, *arguments);
  command->get_option("--camera-model")->excludes(command->get_option("--sensor"));
  command->add_option("--out", arguments->out, "output folder, in TUM layout")
      ->capture_default_str();
  add_quiet_option(*command);
  command->footer(
      "Examples:\n"
      "  stillmap simulate --scene office --people 2 --camera xyz --out office_xyz\n"
      "  stillmap simulate --scene yard --camera trolley --people 3 --objects 3 --camera-model "
      "realsense_d435i --width 640 --fps 15 --frames 526 --out yard_dynamic\n"
      "  stillmap simulate --scene yard --camera trolley --people 0 --camera-model realsense_d435i "
      "--width 1280 --fps 15 --frames 526 --out yard_static");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
