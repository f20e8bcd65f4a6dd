// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/pipeline/options.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <algorithm>
#include <memory>

#include "commands.hpp"
#include "run_session.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

struct RunArguments {
  std::string sequence, camera, preset, model, masks, schedule, config, truth, associations, out,
      dump_config;
  std::vector<std::string> settings;
  int first = 0, count = 0, stride = 1;
  bool half = false;
  LabelRecording labels;
  std::string save_map, load_map;
  bool localize_only = false, slim_map = false;
  DenseOutputs dense;
  bool profile = false;
};

/// Defaults, then the file, then the named options, then --set: what comes later wins.
SlamOptions options_of(const RunArguments& arguments) {
  SlamOptions options;
  if (!arguments.config.empty()) load_options(arguments.config, options);
  if (!arguments.preset.empty()) options.motion.preset = arguments.preset;
  if (!arguments.model.empty()) options.segment.model = arguments.model;
  if (!arguments.masks.empty()) options.segment.masks = arguments.masks;
  if (!arguments.schedule.empty()) options.schedule.mode = arguments.schedule;
  for (const std::string& setting : arguments.settings) set_option(setting, options);
  if (arguments.localize_only) options.dense_cloud = false;  // of a map that is not extended
  check_options(options);
  return options;
}

std::optional<Trajectory> truth_of(const RunArguments& arguments, const SequencePaths& paths) {
  const std::filesystem::path file =
      arguments.truth.empty() ? paths.ground_truth : std::filesystem::path(arguments.truth);
  if (file.empty()) return std::nullopt;
  return read_trajectory(file);
}

bool looks_at_instances_only(const MotionOptions& options) {
  const MotionCues cues = make_cues(options);
  return std::all_of(cues.begin(), cues.end(),
                     [](const auto& cue) { return !cue->classes().empty(); });
}

std::unique_ptr<Detector> detector_of(const SlamOptions& options) {
  if (!find_preset(options.motion.preset).wants_instances) return nullptr;
  auto detector = make_detector(options.segment);
  if (!detector) {
    fmt::print(stderr,
               "stillmap: preset {} has neither a network nor masks to go by, so {};\n"
               "  name a network with --model FILE.onnx, or a folder of masks with --masks DIR\n",
               options.motion.preset,
               looks_at_instances_only(options.motion)
                   ? "nothing is taken for moving"
                   : "only what is seen to move is taken for moving");
  }
  return detector;
}

std::string sequence_name(const std::filesystem::path& folder) {
  const auto absolute = std::filesystem::absolute(folder).lexically_normal();
  return (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string();
}

/// The map to begin in, if one was named; it must be this camera's.
std::optional<StartingMap> start_of(const RunArguments& arguments, const SlamOptions& options,
                                    const Camera& camera) {
  if (arguments.load_map.empty()) return std::nullopt;
  StartingMap start{read_saved_map(arguments.load_map), !arguments.localize_only};
  require_same_camera(start.saved.map, camera, options.orb.pyramid(), arguments.load_map);
  return start;
}

/// Finds out before the run, not after it, whether a map can be saved there.
void check_save_map(const std::filesystem::path& file) {
  if (file.empty()) return;
  if (std::filesystem::is_directory(file)) {
    throw Error("is a folder", file.string(), "name a file with --save-map FILE");
  }
  make_output_folder(file.has_parent_path() ? file.parent_path() : ".");
}

int run(const RunArguments& arguments) {
  const SlamOptions options = options_of(arguments);
  if (!arguments.dump_config.empty()) {
    if (arguments.dump_config == "-") {
      fmt::print("{}", options_yaml(options));
    } else {
      write_file(arguments.dump_config, options_yaml(options));
      fmt::print("written: {}\n", arguments.dump_config);
    }
    return kSuccess;
  }
  if (arguments.sequence.empty()) {
    throw Error("no sequence was named", "run", "stillmap run SEQUENCE, a folder in TUM layout");
  }
  const SequencePaths paths = find_sequence(arguments.sequence, arguments.associations);
  const SourceOptions range{.camera = arguments.camera,
                            .associations = arguments.associations,
                            .first = arguments.first,
                            .count = arguments.count,
                            .stride = arguments.stride,
                            .half_size = arguments.half};
  std::unique_ptr<FrameSource> source = make_source(arguments.sequence, range);
  check(arguments.dense);
  check_save_map(arguments.save_map);
  Session session;
  session.dense = arguments.dense;
  const Stopwatch loading;
  session.start = start_of(arguments, options, source->camera());
  session.maps = {arguments.load_map, arguments.save_map, arguments.slim_map,
                  loading.milliseconds() / 1000};
  session.sequence = sequence_name(arguments.sequence);
  session.total_frames = source->size();
  session.source = std::move(source);
  session.truth = truth_of(arguments, paths);
  session.detector = detector_of(options);
  session.options = options;
  session.out = arguments.out.empty() ? "stillmap_" + session.sequence : arguments.out;
  session.labels = arguments.labels;
  session.profile = arguments.profile;
  return run_session(std::move(session)).interrupted ? kInterrupted : kSuccess;
}

}  // namespace

void add_run_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = app.add_subcommand("run", "map a recorded RGB-D sequence");
  command->add_option("sequence", arguments->sequence,
                      "folder in TUM layout: rgb/, depth/, rgb.txt, depth.txt");
  command->add_option(
      "--camera", arguments->camera,
      "preset name, camera.yaml or an ORB-SLAM settings file; default: SEQUENCE/camera.yaml");
  command->add_option("--preset", arguments->preset,
                      "how motion is told from rest: see below; default fused");
  command->add_option("--model", arguments->model,
                      "YOLOv7, YOLOv8 or YOLO11 network (.onnx) that finds people");
  command->add_option("--masks", arguments->masks,
                      "folder with one mask (8-bit PNG) per frame, made offline");
  command->add_option("--schedule", arguments->schedule,
                      "lockstep (default; repeatable) or realtime");
  command->add_option("--config", arguments->config, "YAML file with options; see --dump-config");
  command->add_option("--set", arguments->settings,
                      "override one option, room.option=value; may be repeated");
  command->add_option("--truth", arguments->truth,
                      "true trajectory (TUM format); default: SEQUENCE/groundtruth.txt");
  command->add_option("--associations", arguments->associations,
                      "file that pairs color and depth images");
  command->add_option("--first", arguments->first, "frames to leave out at the start");
  command->add_option("--count", arguments->count, "frames to use at most; 0: all");
  command->add_option("--stride", arguments->stride, "use every n-th frame");
  command->add_flag(
      "--half", arguments->half,
      "work on pictures of half the width and height: for computers with little time");
  command->add_option("--out", arguments->out,
                      "folder for the results; default: stillmap_SEQUENCE");
  add_dense_options(*command, arguments->dense);
  command->add_flag("--save-verdicts", arguments->labels.save,
                    "also write verdicts.bin: what is thought of every keypoint; stillmap eval "
                    "--verdicts judges it");
  command
      ->add_option("--draw-verdicts", arguments->labels.draw_every,
                   "also draw every n-th frame (30) with the labels into OUT/verdicts")
      ->expected(0, 1)
      ->default_str("30");
  command->add_flag("--profile", arguments->profile,
                    "also tell where the time goes, per thread and function: profile.txt, "
                    "profile.png, and trace.json for chrome://tracing and ui.perfetto.dev");
  CLI::Option* save_map = command->add_option(
      "--save-map", arguments->save_map,
      "also save the map to this file: for --load-map, and for stillmap map info and export");
  command
      ->add_flag("--slim-map", arguments->slim_map,
                 "leave the dense cloud out of the saved map: a third of the size")
      ->needs(save_map);
  CLI::Option* load_map =
      command->add_option("--load-map", arguments->load_map,
                          "begin in this saved map: find the camera there, and extend it");
  command
      ->add_flag("--localize-only", arguments->localize_only,
                 "only find the camera in the loaded map, and leave the map as it is")
      ->needs(load_map)
      ->excludes(save_map);
  command->add_option("--dump-config", arguments->dump_config,
                      "write all options in force to this file (- for the screen), and stop");
  command->footer(
      "Presets:\n" + describe_presets() +
      "Examples:\n"
      "  stillmap run rgbd_dataset_freiburg3_walking_xyz --camera tum_fr3 --model "
      "yolov8n-seg.onnx\n"
      "  stillmap run my_sequence --camera TUM3.yaml --masks my_sequence/mask --out results\n"
      "  stillmap run my_sequence --preset static --set orb.keypoints=1500\n"
      "  stillmap run first_visit --save-map office.map\n"
      "  stillmap run second_visit --load-map office.map --save-map office.map\n"
      "  stillmap run third_visit --load-map office.map --localize-only\n"
      "  stillmap run --dump-config options.yaml\n"
      "Written: trajectory.txt, keyframes.txt, cloud.ply, cloud.png, movers.csv, "
      "movers.jsonl, movers.png, timing.txt, summary.json, report.html; run.map and options.yaml, "
      "from which `stillmap dense` makes the static map again; and\n" +
      dense_files_help());
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
