// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/finding_json.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/evaluate/closure.hpp"
#include "stillmap/evaluate/covariance_error.hpp"
#include "stillmap/evaluate/ghosts.hpp"
#include "stillmap/evaluate/label_figures.hpp"
#include "stillmap/evaluate/mover_error.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/evaluate/surface_error.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/evaluate/truth_findings.hpp"
#include "stillmap/report/cloud_image.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>

#include "command_tree.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "truth.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

struct EvalArguments {
  std::string truth, estimate, json, cloud, surface, sequence, camera, image, labels, verdicts,
      speeds, truth_frame, covariances;
  LabelFigureOptions judging;
  std::size_t frames = 0;
  bool per_frame = false, one_world = false, with_scale = false, force = false;
  bool closure = false, planar = false;
  std::vector<std::string> movers, aligned_like;

  /// Returns the file of motion labels, by either name of the option; empty: none.
  const std::string& label_file() const { return labels.empty() ? verdicts : labels; }
  /// Returns the key of their figures in JSON, which has the name of the option.
  const char* label_key() const { return labels.empty() ? "verdicts" : "motion_labels"; }
  /// Returns the stream of the figures as text; standard error if JSON takes standard output.
  std::FILE* text() const { return json == kStandardOutput ? stderr : stdout; }
};

struct CloudFigures {
  GhostFigures figures;
  std::optional<SurfaceFigures> surface;  ///< None if the true surface is unknown.
  Cloud cloud;
  std::vector<std::uint8_t> ghosts;
};

/// Returns the true static surface from the named file or the folder of a simulated sequence; none
/// if there is no such file.
std::optional<TrueSurface> true_surface(const EvalArguments& arguments) {
  const std::filesystem::path in_sequence =
      std::filesystem::path(arguments.sequence) / "surface.ply";
  if (arguments.surface.empty() && !std::filesystem::exists(in_sequence)) return std::nullopt;
  const std::filesystem::path file =
      arguments.surface.empty() ? in_sequence : std::filesystem::path(arguments.surface);
  return TrueSurface(read_ply(file).points);
}

/// Returns the same frames, each of which is also passed to the surface.
MaskedFrames shown_to(TrueSurface& surface, MaskedFrames frames, const Trajectory& truth,
                      const Camera& camera) {
  return [&surface, frames = std::move(frames), &truth, &camera]() {
    std::optional<MaskedFrame> frame = frames();
    if (!frame) return frame;
    if (const auto pose = pose_at(truth, frame->timestamp)) {
      surface.look(*frame, *pose, camera);
    }
    return frame;
  };
}

/// Returns the ghosts in the cloud, from the true masks of its sequence, and the surface errors if
/// the true surface is known.
/// @param T_truth_estimate  maps the world frame of the estimate to that of the truth
CloudFigures cloud_figures(const EvalArguments& arguments, const Trajectory& truth,
                           const Pose& T_truth_estimate) {
  if (arguments.sequence.empty()) {
    throw Error("ghosts are measured with the true masks of the sequence, and none was named",
                "--cloud", "add --sequence DIR");
  }
  const SequencePaths paths = find_sequence(arguments.sequence);
  if (paths.masks.empty()) {
    throw Error("the sequence has no mask/ folder", arguments.sequence,
                "ghosts are measured with true masks");
  }
  SourceOptions options;
  options.camera = arguments.camera;
  TumFolder source(paths, recorded_camera(arguments.sequence, options));
  MaskedFrames frames = frames_with_masks(source, paths.masks);
  std::optional<TrueSurface> surface = true_surface(arguments);
  if (surface) frames = shown_to(*surface, std::move(frames), truth, source.camera());
  const GhostReference reference = make_ghost_reference(frames, truth, source.camera());
  CloudFigures result;
  result.cloud = read_ply(arguments.cloud);
  if (surface) result.surface = surface->judge(result.cloud.points, T_truth_estimate);
  result.figures = count_ghosts(reference, result.cloud.points, T_truth_estimate);
  result.ghosts = mark_ghosts(reference, result.cloud.points, T_truth_estimate);
  return result;
}

/// Returns the errors of the movers in movers.csv of the run.
MoverErrors mover_figures(const EvalArguments& arguments, const Trajectory& estimate,
                          const Pose& T_truth_estimate) {
  const auto& [first, last] = std::minmax_element(
      estimate.begin(), estimate.end(),
      [](const StampedPose& a, const StampedPose& b) { return a.timestamp < b.timestamp; });
  return compare_movers(read_movers(arguments.movers[1]), read_movers(arguments.movers[0]),
                        T_truth_estimate, first->timestamp, last->timestamp);
}

LabelFigures label_figures(const EvalArguments& arguments) {
  if (arguments.sequence.empty()) {
    throw Error(
        "motion labels are evaluated with the true masks of the sequence, and none was named",
        "--labels", "add --sequence DIR");
  }
  const MotionTruthFolder truth(arguments.sequence, arguments.speeds);
  return evaluate_labels(read_labels(arguments.label_file()), truth, arguments.judging);
}

/// Returns the options with the known alignment, if it is not estimated from the two trajectories.
AteOptions alignment(const EvalArguments& arguments) {
  AteOptions options;
  if (arguments.one_world) options.T_truth_estimate = Pose();
  if (!arguments.aligned_like.empty()) {
    const Trajectory truth = read_trajectory(arguments.aligned_like[0]);
    const Trajectory estimate = read_trajectory(arguments.aligned_like[1]);
    const WorldAlignment world =
        align_worlds(truth, estimate, absolute_trajectory_error(truth, estimate));
    print_to(arguments.text(), "{}", alignment_text(world));
    options.T_truth_estimate = require_alignment(world);
  }
  return options;
}

/// Prints and returns the errors of the trajectory, and those of the cloud and the movers if they
/// were named.
nlohmann::json trajectory_figures(const EvalArguments& arguments) {
  const std::string truth_frame = truth_frame_of(arguments.truth, arguments.truth_frame);
  const Trajectory truth = true_camera_trajectory(arguments.truth, truth_frame);
  const Trajectory estimate = read_trajectory(arguments.estimate);
  EvaluationOptions options{.per_frame = arguments.per_frame,
                            .with_scale = arguments.with_scale,
                            .ate = alignment(arguments)};
  if (arguments.frames > 0) options.total_frames = arguments.frames;
  const Evaluation evaluation = evaluate_trajectory(truth, estimate, options);
  print_to(arguments.text(), "{}", evaluation_text(evaluation));
  nlohmann::json json = evaluation;
  std::vector<Finding> findings = truth_findings(
      truth, estimate, {arguments.truth, arguments.estimate, truth_frame}, !arguments.with_scale);
  for (Finding& finding : findings) finding.severity = Severity::kUntrusted;  // the errors are
  json["findings"] = findings;
  if (arguments.closure) {
    const ClosureError closure = closure_error(evaluation.ate);
    print_to(arguments.text(), "{}", closure_text(closure, arguments.planar));
    json["closure"] = closure;
  }
  if (!arguments.covariances.empty()) {
    const CovarianceFigures figures =
        covariance_figures(truth, estimate, read_covariances(arguments.covariances));
    print_to(arguments.text(), "{}", covariance_text(figures));
    json["covariances"] = figures;
  }
  if (!arguments.cloud.empty() || !arguments.movers.empty())
    print_to(arguments.text(), "{}", alignment_text(evaluation.world));
  if (!arguments.cloud.empty()) {
    const CloudFigures cloud = cloud_figures(arguments, truth, require_alignment(evaluation.world));
    print_to(arguments.text(), "{}", ghost_text(cloud.figures));
    json["ghosts"] = cloud.figures;
    if (cloud.surface) {
      print_to(arguments.text(), "{}", surface_text(*cloud.surface));
      json["surface"] = *cloud.surface;
    }
    if (!arguments.image.empty()) {
      write_png(arguments.image,
                draw_cloud({cloud.cloud.points, cloud.cloud.colors, cloud.ghosts}, estimate));
      print_to(arguments.text(), "written: {}\n", arguments.image);
    }
  }
  if (!arguments.movers.empty()) {
    const MoverErrors errors =
        mover_figures(arguments, estimate, require_alignment(evaluation.world));
    print_to(arguments.text(), "{}", mover_error_text(errors));
    json["movers"] = errors;
  }
  return json;
}

int run(const EvalArguments& arguments) {
  if (arguments.truth.empty() != arguments.estimate.empty() ||
      (arguments.truth.empty() && arguments.label_file().empty())) {
    throw Error("there is nothing to evaluate", "eval",
                "name the true and the estimated trajectory, or labels with --labels FILE");
  }
  require_replaceable(arguments.json, is_figures_file, arguments.force);
  nlohmann::json json = nlohmann::json::object();
  if (!arguments.truth.empty()) json = trajectory_figures(arguments);
  if (!arguments.label_file().empty()) {
    const LabelFigures figures = label_figures(arguments);
    print_to(arguments.text(), "{}", label_text(figures));
    json[arguments.label_key()] = figures;
  }
  json["stillmap"] = STILLMAP_VERSION;
  if (!arguments.json.empty())
    write_named(arguments.json, json_text(json, 2) + "\n", is_figures_file, arguments.force);
  return print_findings(json.value("findings", std::vector<Finding>()));
}

void add_trajectory_options(CLI::App& command, EvalArguments& arguments) {
  command
      .add_option("--frames", arguments.frames,
                  "number of frames of the sequence, for the coverage; default: estimated")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--per-frame", arguments.per_frame, "also compute the RPE from frame to frame");
  add_truth_frame_option(command, arguments.truth_frame);
  CLI::Option* with_scale = command.add_flag(
      "--scale", arguments.with_scale, "also compute the ATE after alignment with scale, Sim(3)");
  CLI::Option* one_world =
      command.add_flag("--one-world", arguments.one_world,
                       "do not align: both trajectories are in the same world frame");
  command
      .add_option("--aligned-like", arguments.aligned_like,
                  "use the alignment of this TRUTH and ESTIMATE, for a run that was localized in "
                  "the map of that run")
      ->expected(2)
      ->excludes(one_world)
      ->excludes(with_scale);
  one_world->excludes(with_scale);
  command.add_option("--covariances", arguments.covariances,
                     "also compare the errors with these covariances (trajectory_covariance.txt "
                     "of the run)");
  CLI::Option* closure =
      command.add_flag("--closure", arguments.closure,
                       "also compute the closure error of a camera that returns to its start");
  command
      .add_flag("--planar", arguments.planar,
                "show the closure error in the horizontal plane as well (z of the truth is up)")
      ->needs(closure);
}

void add_map_options(CLI::App& command, EvalArguments& arguments) {
  command.add_option("--cloud", arguments.cloud, "also measure the ghosts in this cloud (.ply)");
  command.add_option("--sequence", arguments.sequence,
                     "sequence of the cloud or the labels, with depth/ and true masks in mask/");
  command.add_option("--surface", arguments.surface,
                     "points of the true static surface (.ply), for accuracy and "
                     "completeness of the cloud; default: SEQUENCE/surface.ply, if it exists");
  command
      .add_option("--camera", arguments.camera, "camera of the sequence; default: its camera.yaml")
      ->type_name(names_or_file(camera_presets()));
  command.add_option("--image,--picture", arguments.image,
                     "image (.png) of the cloud with its ghosts in red");
  command
      .add_option("--movers", arguments.movers,
                  "also evaluate the movers: movers.csv of the run, then the true ones "
                  "(truth_movers.csv of a simulated sequence)")
      ->expected(2);
}

void add_label_options(CLI::App& command, EvalArguments& arguments) {
  CLI::Option* labels =
      command.add_option("--labels", arguments.labels,
                         "also evaluate these motion labels (labels.bin of stillmap run "
                         "--save-labels): precision and recall of \"moving\"");
  command.add_option("--verdicts", arguments.verdicts, "former name of --labels")
      ->excludes(labels)
      ->group("");
  command.add_option("--speeds", arguments.speeds,
                     "folder with speed images of the masked regions; default: "
                     "SEQUENCE/speed, if it exists");
  command
      .add_option("--moving-above", arguments.judging.moving_above,
                  "minimum speed of moving pixels [m/s]")
      ->capture_default_str();
  command
      .add_option("--still-below", arguments.judging.still_below,
                  "maximum speed of static pixels [m/s]; pixels between the two are ignored")
      ->capture_default_str();
  command
      .add_option("--outline-margin", arguments.judging.outline_margin,
                  "keypoints this close to the outline of a mover are ignored [pixels]")
      ->capture_default_str();
  command.add_flag("--still-people", arguments.judging.still_people,
                   "without true speeds: people count as static, not as moving");
}

}  // namespace

void add_eval_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<EvalArguments>();
  CLI::App* command = app.add_subcommand(
      "eval",
      "trajectory errors (ATE, RPE) by the rules of the TUM benchmark; map and mover errors");
  command->add_option("truth", arguments->truth, "true trajectory, TUM format");
  command->add_option("estimate", arguments->estimate, "estimated trajectory, TUM format");
  add_trajectory_options(*command, *arguments);
  add_map_options(*command, *arguments);
  add_label_options(*command, *arguments);
  command->add_option("--json", arguments->json,
                      "also write the figures to this file (- for standard output)");
  add_force_option(*command, arguments->force);
  command->footer(
      "Examples:\n"
      "  stillmap eval groundtruth.txt trajectory.txt\n"
      "  stillmap eval seq/groundtruth.txt out/trajectory.txt --cloud out/cloud.ply --sequence "
      "seq\n"
      "  stillmap eval second/groundtruth.txt localized/trajectory.txt --aligned-like "
      "first/groundtruth.txt mapped/trajectory.txt\n"
      "  stillmap eval yard/groundtruth.txt out/trajectory.txt --closure --planar\n"
      "  stillmap eval --labels out/labels.bin --sequence seq\n"
      "  stillmap eval seq/groundtruth.txt out/trajectory.txt --movers out/movers.csv "
      "seq/truth_movers.csv");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
