// SPDX-License-Identifier: Apache-2.0
#include "run_request.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/config/unused_option.hpp"
#include "stillmap/evaluate/truth_frame.hpp"
#include "stillmap/map/camera_change.hpp"
#include "stillmap/pipeline/calibrate_shutter.hpp"
#include "stillmap/pipeline/saved_map.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/doctor.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/rotated.hpp"
#include "stillmap/view/view_messages.hpp"

#include <algorithm>
#include <future>
#include <memory>
#include <string>

#include "interrupt.hpp"
#include "output_file.hpp"
#include "truth.hpp"
#include "view_options.hpp"
#include "warning_options.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

bool use_instances_only(const MotionCues& cues) {
  return std::all_of(cues.begin(), cues.end(),
                     [](const auto& cue) { return !cue->classes().empty(); });
}

std::unique_ptr<Detector> detector_of(const std::string& preset, const SlamParameters& parameters,
                                      bool quiet) {
  const MotionCues cues = make_cues(parameters.motion);
  if (!use_instances(cues)) return nullptr;
  auto detector = make_detector(parameters.segment);
  if (!detector && !quiet) {
    print_error(
        "stillmap: preset {} runs without a network and without masks: {};\n"
        "  give a network with --model FILE.onnx, or a folder of masks with --masks DIR\n",
        preset,
        use_instances_only(cues) ? "nothing is detected as moving"
                                 : "only observed motion is detected");
  }
  return detector;
}

/// Returns the map to start from, if one was named.
std::optional<StartingMap> start_of(const RunRequest& request, const SlamParameters& parameters,
                                    const Camera& camera) {
  if (request.load_map.empty()) return std::nullopt;
  StartingMap start{read_saved_map(request.load_map, parameters.dense.memory),
                    !request.localize_only};
  MapContent& map = start.saved.map;
  if (!request.quiet && !same_images(map.camera, camera))
    print_out("{}: map of another camera ({})\n", request.load_map, map.camera.name);
  map = map_for(std::move(map), camera, parameters.orb.pyramid(), request.load_map);
  return start;
}

/// Throws Error before the run if the map cannot be saved to the file.
void check_save_map(const std::filesystem::path& file, bool force) {
  if (file.empty()) return;
  require_replaceable(file, is_saved_map, force);
  make_output_folder(file.has_parent_path() ? file.parent_path() : ".");
}

/// Returns how to wait for the images of a folder that still grows; none if it is complete.
std::optional<Following> following_of(const RunRequest& request) {
  if (!request.follow && !names_live_camera(request.sequence)) return std::nullopt;
  return Following{.patience = request.follow.value_or(Following{}.patience), .stop = interrupted};
}

/// Finds the timing of a recording's shutters as its first frames show it, also those that a stride
/// leaves out, while the run is prepared. Unused if the camera file tells the timing.
std::future<ShutterTiming> shutter_of(const std::string& sequence, SourceOptions range,
                                      const SlamParameters& parameters, const Camera& camera) {
  const bool known = camera.shutter || parameters.schedule.realtime || range.following;
  range.stride = 1;
  range.count = range.count > 0 ? std::min(range.count, kShutterFrames) : kShutterFrames;
  return std::async(std::launch::async, [=] {
    return known ? ShutterTiming{}
                 : calibrate_shutter([&] { return make_source(sequence, range); }, parameters);
  });
}

void print(const ShutterTiming& timing) {
  if (timing == ShutterTiming{}) return;
  print_out("shutters: readout {:.1f} ms, depth delay {:.1f} ms\n", 1000 * timing.readout,
            1000 * timing.depth_delay);
}

/// Returns the settings of the command line that have no effect, with the reasons.
std::vector<Finding> unused_settings(const RunRequest& request, const Options& options) {
  std::vector<Finding> unused;
  const auto add = [&](const std::string& setting, const std::string& reason) {
    unused.push_back(
        make_finding("unused-setting", fmt::format("{} has no effect: {}", setting, reason)));
  };
  const DenseOutputs& outputs = request.outputs.dense;
  for (const std::string& setting : request.settings) {
    const std::string path = setting.substr(0, setting.find('='));
    const auto reason = why_unused(path, options);
    if (reason) add("--set " + setting, *reason);
    if (path == "outputs.mesh_voxel" && outputs.mesh.empty())
      add("--set " + setting, "no mesh is written without --mesh");
    if (path.starts_with("outputs.planner_") && !outputs.planner)
      add("--set " + setting, "no files for planners are written without --planner");
  }
  const bool uses_instances = use_instances(make_cues(parameters_of(options).motion));
  for (const auto& [flag, given] : {std::pair("--model", !request.model.empty()),
                                    std::pair("--masks", !request.masks.empty())}) {
    if (given && !uses_instances)
      add(flag, fmt::format("preset {} uses neither networks nor masks", options.preset()));
  }
  if (uses_instances && !request.model.empty() && !request.masks.empty())
    add("--model", *why_unused("network.model", options));
  if (request.memory) {
    if (const auto reason = why_unused("dense.memory", options)) add("--memory", *reason);
  }
  if ((outputs.planner || !outputs.mesh.empty()) && !options.dense.enabled)
    add("--planner or --mesh", "dense.enabled is false, so there is no dense map");
  return unused;
}

/// Returns the finding that the detector knows none of the classes that move; none if it knows one.
std::optional<Finding> no_moving_class(const Detector& detector, const Options& options) {
  const auto& known = detector.class_names();
  const auto& moving = options.motion.moving_classes;
  if (moving.empty() ||
      std::find_first_of(known.begin(), known.end(), moving.begin(), moving.end()) != known.end())
    return std::nullopt;
  constexpr std::size_t kNamed = 10;
  const std::vector<std::string> some(known.begin(),
                                      known.begin() + std::min(kNamed, known.size()));
  return make_finding(
      "no-moving-class",
      fmt::format("the network knows none of the classes that move ({})", fmt::join(moving, ", ")),
      fmt::format("name those of its own ({}{}) with --set motion.moving_classes=...",
                  fmt::join(some, ", "), known.size() > kNamed ? ", ..." : ""));
}

/// Adds the class of a single-class network to the moving classes, whatever its name, unless these
/// are empty.
void take_only_class(const Detector& detector, Session& session) {
  const std::vector<std::string>& known = detector.class_names();
  std::vector<std::string>& moving = session.options.motion.moving_classes;
  if (known.size() != 1 || moving.empty() ||
      std::find(moving.begin(), moving.end(), known.front()) != moving.end())
    return;
  moving.push_back(known.front());
  session.parameters.motion = parameters_of(session.options).motion;
  session.findings.push_back(make_finding(
      "only-class", fmt::format("the only class of the network, '{}', is taken as a moving class "
                                "(motion.moving_classes)",
                                known.front())));
}

/// Returns what to warn of; none without --zones.
std::optional<WarningRules> rules_of(const RunRequest& request, const Options& options) {
  if (request.zones.empty()) return std::nullopt;
  if (!options.movers.enabled) {
    throw Error("nobody would be warned of anything: no moving objects are looked for", "--zones",
                "use --set movers.enabled=true");
  }
  return read_warning_rules(request.zones, hook_at(request.hook_offset));
}

/// Returns the classes of a network or of masks; none without them.
std::optional<std::vector<std::string>> classes_of(const std::unique_ptr<Detector>& detector) {
  if (!detector) return std::nullopt;
  return detector->class_names();
}

/// Returns the file of the true trajectory; empty: there is none.
std::filesystem::path truth_file(const RunRequest& request) {
  return request.truth.empty() ? true_trajectory_file(request.sequence)
                               : std::filesystem::path(request.truth);
}

/// Returns the true trajectory of the recording; none if it has none.
std::optional<Trajectory> truth_of(const RunRequest& request) {
  const std::filesystem::path file = truth_file(request);
  if (file.empty()) return std::nullopt;
  Trajectory truth = true_camera_trajectory(file, truth_frame_of(file, request.truth_frame));
  if (request.rotate == 0) return truth;
  return in_camera_frame(truth, {Pose(), turned_camera(request.rotate)});
}

/// Returns the absolute path of the recording, or the name of a live camera.
std::string recording_of(const RunRequest& request) {
  if (names_live_camera(request.sequence)) return request.sequence;
  return std::filesystem::absolute(request.sequence).lexically_normal().string();
}

/// Returns the truth. A file that lies in the folder of the sequence, without being named, and
/// cannot be read becomes a finding.
std::optional<Trajectory> found_truth(const RunRequest& request, std::vector<Finding>& findings) {
  try {
    return truth_of(request);
  } catch (const Error& error) {
    if (!request.truth.empty() || !request.truth_frame.empty()) throw;
    findings.push_back(with_severity(Severity::kNote, unreadable_truth(error)));
    return std::nullopt;
  }
}

}  // namespace

Options options_of(const RunRequest& request) {
  Options options = read_options(request.preset, request.config);
  if (!request.model.empty()) options.network.model = request.model;
  if (!request.masks.empty()) options.network.masks = request.masks;
  if (!request.schedule.empty()) options.schedule.mode = request.schedule;
  options.input.first = request.first.value_or(options.input.first);
  options.input.count = request.count.value_or(options.input.count);
  options.input.stride = request.stride.value_or(options.input.stride);
  options.dense.memory = request.memory.value_or(options.dense.memory);
  if (request.half_size) options.input.half_size = true;
  for (const std::string& setting : request.settings) set_option(setting, options);
  check_options(options);
  return options;
}

std::string sequence_name(const std::filesystem::path& folder) {
  if (const std::string text = folder.string(); names_live_camera(text))
    return text.substr(0, text.find(':'));
  const auto absolute = std::filesystem::absolute(folder).lexically_normal();
  if (!absolute.has_filename()) return absolute.parent_path().filename().string();
  return (is_file(absolute) ? absolute.stem() : absolute.filename()).string();
}

Session session_of(const RunRequest& request, const Options& options) {
  check(request.outputs.dense);
  if (request.sequence.empty()) {
    throw Error("no sequence was named", "run",
                "stillmap run SEQUENCE, a folder in TUM layout or a recorded file");
  }
  if (request.rotate != 0 && !request.masks.empty()) {
    throw Error("masks of the recorded images do not fit turned ones", "--rotate",
                "turn the recording first: stillmap record " + request.sequence +
                    " FOLDER --rotate " + std::to_string(request.rotate));
  }
  const SourceOptions range{.camera = request.camera,
                            .ignore = request.ignore,
                            .topics = request.topics,
                            .associations = request.associations,
                            .fps = request.fps,
                            .first = options.input.first,
                            .count = options.input.count,
                            .stride = options.input.stride,
                            .rotate = request.rotate,
                            .half_size = options.input.half_size,
                            .following = following_of(request)};
  std::unique_ptr<FrameSource> source = make_source(request.sequence, range);
  if (!request.quiet) {
    for (const std::string& note : source->notes()) print_out("{}\n", note);
  }
  check_save_map(request.save_map, request.force);
  Session session;
  session.options = options;
  session.findings = source->findings();
  append(unused_settings(request, options), session.findings);
  session.parameters = parameters_of(options);
  std::future<ShutterTiming> shutter =
      shutter_of(request.sequence, range, session.parameters, source->camera());
  session.outputs = request.outputs;
  session.outputs.save_map = request.save_map;
  session.sequence = sequence_name(request.sequence);
  session.out = request.out.empty() ? "stillmap_" + session.sequence : request.out;
  session.parameters.dense.memory.folder = session.out;
  const Stopwatch loading;
  session.start = start_of(request, session.parameters, source->camera());
  if (session.start) {
    if (!session.start->saved.damage.empty())
      session.findings.push_back(make_finding("damaged-map", session.start->saved.damage));
    session.loaded =
        LoadedMap{request.load_map, session.start->extend, loading.milliseconds() / 1000};
  }
  session.recording = recording_of(request);
  if (std::filesystem::is_directory(request.sequence) && names_image_folder(request.sequence) &&
      !range.following) {
    const auto depth = depth_unit_finding(request.sequence, source->camera(), request.associations);
    const auto order = order_finding(request.sequence, request.associations);
    if (depth) session.findings.push_back(*depth);
    if (order) session.findings.push_back(*order);
  }
  if (request.force) session.foreign = ResultFolder::Foreign::kOverwrite;
  session.rules = rules_of(request, options);
  session.event_lines = request.event_lines;
  session.quiet = request.quiet;
  session.verbose = request.verbose;
  session.total_frames = source->size();
  session.live_camera = names_live_camera(request.sequence);
  session.live = session.live_camera || request.follow.has_value();
  session.truth = found_truth(request, session.findings);
  session.names = {.truth = truth_file(request).string(),
                   .estimate = "trajectory.txt",
                   .truth_frame = truth_frame_of(truth_file(request), request.truth_frame),
                   .estimate_is_own = true};
  session.detector = detector_of(options.preset(), session.parameters, request.quiet);
  if (session.rules)
    check_rule_classes(*session.rules, classes_of(session.detector), request.zones);
  check_classes(options, session.detector.get());
  if (session.detector) {
    take_only_class(*session.detector, session);
    if (auto finding = no_moving_class(*session.detector, session.options))
      session.findings.push_back(*std::move(finding));
  }
  require_free_outputs(session);
  session.view = opened_view(view_address_of(request.view));
  if (session.view) {
    session.view->board().publish(run_message(session.sequence, source->camera(),
                                              session.total_frames, Viewed::kRunInProgress));
  }
  session.parameters.tracker.shutter = shutter.get();
  if (!request.quiet) print(session.parameters.tracker.shutter);
  session.source = std::move(source);
  return session;
}

}  // namespace stillmap
