// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/config/write_options.hpp"
#include "stillmap/pipeline/calibrate_shutter.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <algorithm>
#include <memory>
#include <optional>

#include "command_tree.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "run_session.hpp"
#include "truth.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

struct RunArguments {
  std::string sequence, camera, preset, model, masks, schedule, config, truth, truth_frame,
      associations, out, dump_config;
  std::vector<std::string> settings;
  std::optional<int> first, count, stride;
  bool half_size = false;
  std::string load_map, save_map;
  bool localize_only = false, force = false;
  RunOutputs outputs;
};

/// Returns all options in force. Precedence from low to high: defaults, preset, --config, named
/// options, --set.
Options options_of(const RunArguments& arguments) {
  Options options = read_options(arguments.preset, arguments.config);
  if (!arguments.model.empty()) options.network.model = arguments.model;
  if (!arguments.masks.empty()) options.network.masks = arguments.masks;
  if (!arguments.schedule.empty()) options.schedule.mode = arguments.schedule;
  options.input.first = arguments.first.value_or(options.input.first);
  options.input.count = arguments.count.value_or(options.input.count);
  options.input.stride = arguments.stride.value_or(options.input.stride);
  if (arguments.half_size) options.input.half_size = true;
  for (const std::string& setting : arguments.settings) set_option(setting, options);
  if (arguments.localize_only) options.dense.enabled = false;  // the map is not extended
  check_options(options);
  return options;
}

std::optional<Trajectory> truth_of(const RunArguments& arguments, const SequencePaths& paths) {
  const std::filesystem::path file =
      arguments.truth.empty() ? paths.ground_truth : std::filesystem::path(arguments.truth);
  if (file.empty()) return std::nullopt;
  note_marker_truth(file, arguments.truth_frame);
  return true_camera_trajectory(file, arguments.truth_frame);
}

bool use_instances_only(const MotionCues& cues) {
  return std::all_of(cues.begin(), cues.end(),
                     [](const auto& cue) { return !cue->classes().empty(); });
}

std::unique_ptr<Detector> detector_of(const std::string& preset, const SlamParameters& parameters) {
  const MotionCues cues = make_cues(parameters.motion);
  if (!use_instances(cues)) return nullptr;
  auto detector = make_detector(parameters.segment);
  if (!detector) {
    fmt::print(stderr,
               "stillmap: preset {} runs without a network and without masks: {};\n"
               "  give a network with --model FILE.onnx, or a folder of masks with --masks DIR\n",
               preset,
               use_instances_only(cues) ? "nothing is detected as moving"
                                        : "only observed motion is detected");
  }
  return detector;
}

std::string sequence_name(const std::filesystem::path& folder) {
  const auto absolute = std::filesystem::absolute(folder).lexically_normal();
  return (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string();
}

/// Returns the map to start from, if one was named. Throws Error if it was made with another
/// camera.
std::optional<StartingMap> start_of(const RunArguments& arguments, const PyramidShape& pyramid,
                                    const Camera& camera) {
  if (arguments.load_map.empty()) return std::nullopt;
  StartingMap start{read_saved_map(arguments.load_map), !arguments.localize_only};
  require_same_camera(start.saved.map, camera, pyramid, arguments.load_map);
  return start;
}

/// Throws Error before the run if the map cannot be saved to the file.
void check_save_map(const std::filesystem::path& file, bool force) {
  if (file.empty()) return;
  require_replaceable(file, is_saved_map, force);
  make_output_folder(file.has_parent_path() ? file.parent_path() : ".");
}

/// Returns the timing of a recording's shutters as its first frames show it. Unused if the camera
/// file tells the timing.
ShutterTiming shutter_of(const std::string& sequence, SourceOptions range,
                         const SlamParameters& parameters, const Camera& camera) {
  if (camera.shutter || parameters.schedule.realtime || range.stride != 1) return {};
  const int frames = range.count;
  range.count = frames > 0 ? std::min(frames, kShutterFrames) : kShutterFrames;
  const ShutterTiming timing =
      calibrate_shutter([&] { return make_source(sequence, range); }, parameters);
  if (timing == ShutterTiming{}) return timing;
  fmt::print("shutters: readout {:.1f} ms, depth delay {:.1f} ms\n", 1000 * timing.readout,
             1000 * timing.depth_delay);
  return timing;
}

int run(const RunArguments& arguments) {
  const Options options = options_of(arguments);
  if (!arguments.dump_config.empty()) {
    write_named(arguments.dump_config, options_yaml(options), is_options_file, arguments.force);
    return kSuccess;
  }
  check(arguments.outputs.dense);
  if (arguments.sequence.empty()) {
    throw Error("no sequence was named", "run", "stillmap run SEQUENCE, a folder in TUM layout");
  }
  const SequencePaths paths = find_sequence(arguments.sequence, arguments.associations);
  const SourceOptions range{.camera = arguments.camera,
                            .associations = arguments.associations,
                            .first = options.input.first,
                            .count = options.input.count,
                            .stride = options.input.stride,
                            .half_size = options.input.half_size};
  std::unique_ptr<FrameSource> source = make_source(arguments.sequence, range);
  check_save_map(arguments.save_map, arguments.force);
  Session session;
  session.options = options;
  session.parameters = parameters_of(options);
  session.outputs = arguments.outputs;
  session.outputs.save_map = arguments.save_map;
  const Stopwatch loading;
  session.start = start_of(arguments, session.parameters.orb.pyramid(), source->camera());
  if (session.start)
    session.loaded =
        LoadedMap{arguments.load_map, session.start->extend, loading.milliseconds() / 1000};
  session.sequence = sequence_name(arguments.sequence);
  session.out = arguments.out.empty() ? "stillmap_" + session.sequence : arguments.out;
  if (arguments.force) session.foreign = ResultFolder::Foreign::kOverwrite;
  session.total_frames = source->size();
  session.truth = truth_of(arguments, paths);
  session.detector = detector_of(options.preset(), session.parameters);
  check_classes(options, session.detector.get());
  require_free_outputs(session);
  session.parameters.tracker.shutter =
      shutter_of(arguments.sequence, range, session.parameters, source->camera());
  session.source = std::move(source);
  return run_session(std::move(session)).interrupted ? kInterrupted : kSuccess;
}

void add_input_options(CLI::App& command, RunArguments& arguments) {
  command.add_option("--truth", arguments.truth,
                     "ground truth trajectory (TUM format); default: SEQUENCE/groundtruth.txt");
  add_truth_frame_option(command, arguments.truth_frame);
  command.add_option("--associations", arguments.associations,
                     "file that pairs color and depth images");
  command.add_option("--first", arguments.first, "number of frames to skip at the start");
  command.add_option("--count", arguments.count, "maximum number of frames; 0: all");
  command.add_option("--stride", arguments.stride, "use every n-th frame");
  command.add_flag("--half", arguments.half_size,
                   "use images of half the width and height, for slow computers");
}

void add_output_options(CLI::App& command, RunArguments& arguments) {
  command.add_option("--out", arguments.out, "output folder; default: stillmap_SEQUENCE");
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

void add_map_options(CLI::App& command, RunArguments& arguments) {
  CLI::Option* save_map =
      command.add_option("--save-map", arguments.save_map,
                         "also save the map to this file, for --load-map and stillmap map");
  command
      .add_flag("--slim-map", arguments.outputs.slim_map,
                "save the map without its dense views: a third of the size")
      ->needs(save_map);
  CLI::Option* load_map =
      command.add_option("--load-map", arguments.load_map,
                         "start from this saved map: localize the camera in it, and extend it");
  command
      .add_flag("--localize-only", arguments.localize_only,
                "only localize the camera in the loaded map; the map is not changed")
      ->needs(load_map)
      ->excludes(save_map);
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = app.add_subcommand("run", "map a recorded RGB-D sequence");
  command->add_option("sequence", arguments->sequence,
                      "folder in TUM layout: rgb/, depth/, rgb.txt, depth.txt");
  command
      ->add_option(
          "--camera", arguments->camera,
          "preset name, camera.yaml or an ORB-SLAM settings file; default: SEQUENCE/camera.yaml")
      ->type_name(names_or_file(camera_presets()));
  std::vector<std::string> preset_names;
  for (const Preset& preset : presets()) preset_names.push_back(preset.name);
  command
      ->add_option("--preset", arguments->preset,
                   "name of a preset (see below) or YAML file; default fused")
      ->type_name(names_or_file(preset_names));
  command->add_option("--model", arguments->model,
                      "segmentation network (.onnx): YOLOv7, YOLOv8 or YOLO11");
  command->add_option("--masks", arguments->masks,
                      "folder with one precomputed mask (8-bit PNG) per frame");
  command
      ->add_option("--schedule", arguments->schedule,
                   "schedule; lockstep is reproducible, and the default")
      ->type_name("{lockstep,realtime}");
  command->add_option("--config", arguments->config,
                      "YAML file with options; see --dump-config and docs/options.md");
  command
      ->add_option("--set", arguments->settings,
                   "override one option, group.name=value; may be repeated")
      ->allow_extra_args(false);
  add_input_options(*command, *arguments);
  add_output_options(*command, *arguments);
  add_map_options(*command, *arguments);
  command->add_option("--dump-config", arguments->dump_config,
                      "write all options in force to this file (- for standard output) and exit");
  command->footer(
      "Presets:\n" + presets_text() +
      "Examples:\n"
      "  stillmap run rgbd_dataset_freiburg3_walking_xyz --camera tum_fr3 --model "
      "yolov8n-seg.onnx\n"
      "  stillmap run my_sequence --camera TUM3.yaml --masks my_sequence/mask --out results\n"
      "  stillmap run my_sequence --preset static --set features.keypoints=1500\n"
      "  stillmap run first_visit --save-map office.map\n"
      "  stillmap run second_visit --load-map office.map --save-map office.map\n"
      "  stillmap run third_visit --load-map office.map --localize-only\n"
      "  stillmap run --dump-config options.yaml\n"
      "Files:\n" +
      files_help("always", RunPart::kAlways) +
      files_help("unless movers.enabled is false", RunPart::kMovers) +
      files_help("unless dense.enabled is false", RunPart::kDense) + dense_files_help() +
      files_help("--save-labels", RunPart::kLabels) + files_help("--profile", RunPart::kProfile) +
      "docs/dense_map.md explains them; `stillmap dense` makes the dense map again from run.map "
      "and "
      "options.yaml.");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
