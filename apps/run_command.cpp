// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/print.hpp"
#include "stillmap/config/write_options.hpp"
#include "stillmap/sensor/camera_file.hpp"

#include <memory>

#include "command_tree.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "progress.hpp"
#include "run_request.hpp"
#include "terminal.hpp"
#include "truth.hpp"
#include "warning_options.hpp"

namespace stillmap {
namespace {

struct RunArguments : RunRequest {
  std::string dump_config, events;
};

int run(const RunArguments& arguments) {
  const Options options = options_of(arguments);
  if (!arguments.dump_config.empty()) {
    write_named(arguments.dump_config, options_yaml(options), is_options_file, arguments.force);
    return kSuccess;
  }
  Session session = session_of(arguments, options);
  const std::filesystem::path out = session.out;
  const RunRecord record = run_session(std::move(session));
  const int code = print_findings(record.findings);
  if (!arguments.quiet) {
    print_out("{}", open_line(out / "report.html",
                              ", or turn the map in a browser: stillmap view " + out.string()));
  }
  if (record.interrupted) return kInterrupted;
  return code;
}

}  // namespace

void add_recording_options(CLI::App& command, RunRequest& arguments) {
  command.option_defaults()->group("Recording");
  command
      .add_option("--camera", arguments.camera,
                  "preset name, camera.yaml or an ORB-SLAM settings file; default: that of the "
                  "recording (camera.yaml, camera_info)")
      ->type_name(names_or_file(camera_presets()));
  command
      .add_option("--ignore", arguments.ignore,
                  "image of the recorded size: pixels that are white in it (the robot itself) are "
                  "ignored; default: 'ignore' of the camera file")
      ->type_name("FILE");
  command.add_option("--truth", arguments.truth,
                     "ground truth trajectory (TUM format); default: SEQUENCE/groundtruth.txt");
  add_truth_frame_option(command, arguments.truth_frame);
  command.add_option("--topics", arguments.topics,
                     "COLOR,DEPTH or, of a stereo pair, LEFT,RIGHT: topics of a recorded file; "
                     "default: color and depth by type, encoding and name");
  command.add_option("--associations", arguments.associations,
                     "file that pairs color and depth images");
  command.add_option("--fps", arguments.fps,
                     "rate of images whose names are numbers, not times; default 30");
  command
      .add_option("--follow", arguments.follow,
                  "the folder still grows: wait for images until none has come for this time [s]")
      ->expected(0, 1)
      ->default_str("5");
  command.add_option("--first", arguments.first, "number of frames to skip at the start");
  command.add_option("--count", arguments.count, "maximum number of frames; 0: all");
  command.add_option("--stride", arguments.stride, "use every n-th frame");
  command
      .add_option("--rotate", arguments.rotate,
                  "turn the images clockwise by 90, 180 or 270 degrees, so that the floor is at "
                  "their bottom: of a phone held upright, or of a camera mounted upside down")
      ->type_name("DEGREES");
  command.add_flag("--half", arguments.half_size,
                   "use images of half the width and height, for slow computers");
}

void add_method_options(CLI::App& command, RunRequest& arguments) {
  command.option_defaults()->group("Method");
  std::vector<std::string> preset_names;
  for (const Preset& preset : presets()) preset_names.push_back(preset.name);
  command
      .add_option("--preset", arguments.preset,
                  "name of a preset (see below) or YAML file; default fused")
      ->type_name(names_or_file(preset_names));
  command.add_option(
      "--model", arguments.model,
      "network for segmentation or detection (.onnx), such as YOLO, RF-DETR or RTMDet");
  command.add_option("--masks", arguments.masks,
                     "folder with one precomputed mask (8-bit PNG) per frame");
  command
      .add_option("--schedule", arguments.schedule,
                  "schedule; lockstep is reproducible, and the default")
      ->type_name("{lockstep,realtime}");
  command
      .add_option("--memory", arguments.memory,
                  "memory for the views of the dense map and the features of keyframes [MB]; those "
                  "not used for the longest time are kept in temporary files in OUT; default 180")
      ->type_name("MB");
  command.add_option("--config", arguments.config,
                     "YAML file with options; see --dump-config and docs/options.md");
  command
      .add_option("--set", arguments.settings,
                  "override one option, group.name=value; may be repeated")
      ->allow_extra_args(false);
}

void add_result_options(CLI::App& command, RunRequest& arguments) {
  command.option_defaults()->group("Results");
  add_force_option(command, arguments.force);
  add_dense_options(command, arguments.outputs.dense);
  LabelRecording& labels = arguments.outputs.labels;
  command.add_flag("--save-labels", labels.save,
                   "also write labels.bin: the motion label of every keypoint, for stillmap eval "
                   "--labels");
  command
      .add_option("--draw-labels", labels.draw_every,
                  "also draw every n-th frame (30) with its motion labels into OUT/labels")
      ->expected(0, 1)
      ->default_str("30");
  command
      .add_option("--figures", arguments.outputs.figures,
                  "also draw figures of these frames into OUT/figures, such as 30,60: objects, "
                  "optical flow, kept keypoints, depth without movers; and of the sparse and dense "
                  "map before and after the removal of movers")
      ->delimiter(',')
      ->allow_extra_args(false);
  // The former names of the two options, and of their files.
  const auto rename = [&labels] { labels.name = "verdicts"; };
  command
      .add_flag_callback("--save-verdicts",
                         [&labels, rename] {
                           labels.save = true;
                           rename();
                         })
      ->group("");
  command
      .add_option_function<int>("--draw-verdicts",
                                [&labels, rename](int every) {
                                  labels.draw_every = every;
                                  rename();
                                })
      ->expected(0, 1)
      ->default_str("30")
      ->group("");
  command.add_flag("--profile", arguments.outputs.profile,
                   "also write the computing time per thread and function: profile.txt, "
                   "profile.svg, and trace.json for ui.perfetto.dev or chrome://tracing");
}

CLI::Option* add_start_options(CLI::App& command, RunRequest& arguments) {
  command.option_defaults()->group("Saved maps");
  CLI::Option* load_map = command.add_option(
      "--load-map", arguments.load_map,
      "start from this saved map, or the map in the folder of a run: localize the camera in it, "
      "and extend it");
  return command
      .add_flag("--localize-only", arguments.localize_only,
                "only localize the camera in the loaded map; the map is not changed")
      ->needs(load_map);
}

namespace {

void add_view_and_terminal_options(CLI::App& command, RunArguments& arguments) {
  command.option_defaults()->group("View and warnings");
  add_view_options(command, arguments.view);
  CLI::Option* zones = command.add_option(
      "--zones", arguments.zones,
      "YAML file of zones and distances; warn of moving objects in them (docs/view.md): an aid, "
      "no safety device");
  add_hook_offset(command, arguments.hook_offset)->needs(zones);
  add_events_option(command, arguments.events)->needs(zones);
  command.option_defaults()->group("Terminal");
  command.add_flag_callback(
      "-q,--quiet",
      [&arguments] {
        arguments.quiet = true;
        Progress::hide();
      },
      "print nothing but problems");
  command.add_flag("-v,--verbose", arguments.verbose,
                   "also print all events of the run and the times of its stages");
}

void add_saving_options(CLI::App& command, RunArguments& arguments, CLI::Option& localize_only) {
  CLI::Option* save_map =
      command.add_option("--save-map", arguments.save_map,
                         "also save the map to this file, for --load-map and stillmap map");
  command
      .add_flag("--slim-map", arguments.outputs.slim_map,
                "save the map without its dense views: a third of the size")
      ->needs(save_map);
  localize_only.excludes(save_map);
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = app.add_subcommand("run", "map a recorded RGB-D sequence");
  command->add_option("sequence", arguments->sequence,
                      "recording: FILE.bag, FILE.db3 or FILE.mcap of ROS or RealSense, or a folder "
                      "in TUM layout (rgb/, depth/, rgb.txt, depth.txt)");
  add_recording_options(*command, *arguments);
  add_method_options(*command, *arguments);
  command->add_option("--dump-config", arguments->dump_config,
                      "write all options in force to this file (- for standard output) and exit");
  command->option_defaults()->group("Results");
  command->add_option("--out", arguments->out, "output folder; default: stillmap_SEQUENCE");
  add_result_options(*command, *arguments);
  CLI::Option* localize_only = add_start_options(*command, *arguments);
  add_saving_options(*command, *arguments, *localize_only);
  add_view_and_terminal_options(*command, *arguments);
  command->footer(
      "Presets:\n" + presets_text() +
      "Examples:\n"
      "  stillmap run rgbd_dataset_freiburg3_walking_xyz --camera tum_fr3 --model "
      "yolov8n-seg.onnx\n"
      "  stillmap run my_sequence --camera TUM3.yaml --masks my_sequence/mask --out results\n"
      "  stillmap run my_sequence --preset static --set features.keypoints=1500\n"
      "  stillmap run recorded.mcap --out results\n"
      "  stillmap run recording_now --camera bonn --follow 10\n"
      "  stillmap run first_visit --save-map office.map\n"
      "  stillmap run second_visit --load-map office.map --save-map office.map\n"
      "  stillmap run third_visit --load-map office.map --localize-only\n"
      "  stillmap run my_sequence --view\n"
      "  stillmap run --dump-config options.yaml\n"
      "Files:\n" +
      files_help("always", RunPart::kAlways) +
      files_help("during the run (the journal is removed at its end)", RunPart::kLive) +
      files_help("unless movers.enabled is false", RunPart::kMovers) +
      files_help("unless dense.enabled is false", RunPart::kDense) + dense_files_help() +
      files_help("--load-map", RunPart::kChanges) + files_help("--zones", RunPart::kWarnings) +
      files_help("--save-labels", RunPart::kLabels) + files_help("--profile", RunPart::kProfile) +
      "docs/dense_map.md explains them; `stillmap dense` makes the dense map again from run.map "
      "and options.yaml.");
  command->callback([arguments, &exit_code] {
    if (!arguments->events.empty()) arguments->event_lines = standard_output_for_data();
    exit_code = run(*arguments);
  });
}

}  // namespace stillmap
