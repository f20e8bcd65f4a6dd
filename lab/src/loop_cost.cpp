// SPDX-License-Identifier: Apache-2.0
/// Gain and cost of loop closing. A sequence with ground truth is mapped without and with loop
/// closing in turn, in lockstep (as fast as it goes) and in real time. Printed: ATE and coverage;
/// for every loop or merge the correction, and the milliseconds of the pose graph, of all work on
/// the mapping thread and of the global adjustment in its own thread; and the tracking cost of the
/// frames during loop closing, compared with the same frames of the runs without loops: wall time,
/// CPU time, preemptions and page faults, median and 95th percentile. If CPU time rises with wall
/// time, there is more work or memory is slow; if it does not, the thread waits.
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/paced_source.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <numbers>
#include <sys/resource.h>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

struct Arguments {
  std::string sequence, out;
  int lockstep = 1, realtime = 3;  ///< numbers of runs
  double slower = 1;               ///< factor of slow motion
};

/// Resources used by the calling thread so far.
struct Usage {
  double cpu_ms = 0, switches = 0, pages = 0;
};

Usage used_by_this_thread() {
  rusage r{};
  getrusage(RUSAGE_THREAD, &r);
  const auto ms = [](const timeval& t) {
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_usec);
  };
  return {ms(r.ru_utime) + ms(r.ru_stime), static_cast<double>(r.ru_nivcsw),
          static_cast<double>(r.ru_minflt)};
}

/// Cost of one frame on the tracking thread.
struct Effort {
  double milliseconds = 0, cpu_ms = 0, switches = 0, pages = 0;
};

struct Run {
  SlamResult result;
  std::vector<Effort> efforts;  ///< one per frame of the result
  std::size_t dropped = 0;
  double ate = 0;
  double fps = 30;
};

Run run(const Arguments& arguments, bool loops, bool realtime) {
  const SequencePaths paths = find_sequence(arguments.sequence);
  std::unique_ptr<FrameSource> source = std::make_unique<Prefetch>(
      std::make_unique<TumFolder>(paths, read_camera(paths.camera.string())), 4,
      realtime ? ThreadPriority::kNone : ThreadPriority::kMap);
  PacedSource* paced = nullptr;
  if (realtime) {
    auto wrapped = std::make_unique<PacedSource>(std::move(source), arguments.slower);
    paced = wrapped.get();
    source = std::move(wrapped);
  }
  SlamParameters options;
  options.places.loops = loops;
  options.schedule.realtime = realtime;
  SlamSystem slam(source->camera(), options);
  Run made;
  while (const auto frame = source->next()) {
    const Usage before = used_by_this_thread();
    slam.push(frame);
    const Usage after = used_by_this_thread();
    made.efforts.push_back({0, after.cpu_ms - before.cpu_ms, after.switches - before.switches,
                            after.pages - before.pages});
  }
  made.result = slam.finish();
  for (std::size_t i = 0; i < made.efforts.size(); ++i)
    made.efforts[i].milliseconds = made.result.frames[i].times.total();
  made.dropped = paced != nullptr ? paced->dropped().size() : 0;
  made.fps = source->camera().fps;
  made.ate = absolute_trajectory_error(read_trajectory(paths.ground_truth), made.result.trajectory)
                 .translation.rmse;
  return made;
}

/// One loop closure or merge, and the global adjustment that followed it.
struct Closing {
  MapEvent event;
  double adjustment_ms = 0;
};

std::vector<Closing> closings(const SlamResult& result) {
  const auto adjustments = result.timing.samples("global adjustment");
  std::vector<Closing> made;
  for (const MapEvent& event : result.events) {
    if (event.kind == MapEvent::Kind::kDropped) continue;
    made.push_back({event, made.size() < adjustments.size() ? adjustments[made.size()] : 0});
  }
  return made;
}

void print(const char* name, const Run& run) {
  fmt::print("{}: ATE {:.4f} m, {} of {} frames tracked, {} dropped late, {} keyframes, {} maps\n",
             name, run.ate, run.result.tracked(), run.result.frames.size() + run.dropped,
             run.dropped, run.result.keyframes.size(), run.result.maps);
  for (const Closing& c : closings(run.result)) {
    const MapEvent& e = c.event;
    fmt::print(
        "  {}: frame {} shows the place of frame {}: {} landmarks agree, {} fused, moved by "
        "{:.3f} m and {:.2f} degrees; {} keyframes: pose graph {:.0f} ms, in all {:.0f} ms, "
        "global bundle adjustment {:.0f} ms\n",
        e.kind == MapEvent::Kind::kLoop ? "loop" : "merge", e.frame_index, e.seen_in, e.inliers,
        e.fused, e.meters, e.radians * 180 / std::numbers::pi, e.keyframes, e.graph_ms,
        e.milliseconds, c.adjustment_ms);
  }
}

/// Returns whether a frame was tracked between the keyframe of a loop and the end of its global
/// adjustment (in lockstep: the frame at which the result is applied).
bool is_during(const Closing& c, std::size_t frame, double fps, bool realtime) {
  constexpr double kRefining = 150;  // ms from the keyframe to the loop, and from there to the copy
  if (frame < c.event.frame_index) return false;
  const auto since = static_cast<double>(frame - c.event.frame_index);
  if (!realtime) return since <= ScheduleOptions{}.global_delay;
  return since <= (kRefining + c.event.milliseconds + c.adjustment_ms) / 1000 * fps;
}

/// Returns the tracking effort of the run `measured` in the frames during which the run `closed`
/// closed loops.
std::vector<Effort> efforts_during(const Run& closed, const Run& measured, bool realtime) {
  const auto all = closings(closed.result);
  std::vector<Effort> efforts;
  for (std::size_t i = 0; i < measured.efforts.size(); ++i) {
    const auto during = [&](const Closing& c) {
      return is_during(c, measured.result.frames[i].index, closed.fps, realtime);
    };
    if (std::any_of(all.begin(), all.end(), during)) efforts.push_back(measured.efforts[i]);
  }
  return efforts;
}

void print(const char* name, double Effort::*part, const std::vector<Effort>& during,
           const std::vector<Effort>& alone) {
  const auto samples = [&](const std::vector<Effort>& efforts) {
    std::vector<double> values;
    for (const Effort& effort : efforts) values.push_back(effort.*part);
    return values;
  };
  const auto of = samples(during), of_alone = samples(alone);
  const double p95 = quantile(of, 0.95), p95_alone = quantile(of_alone, 0.95);
  fmt::print("  {:10} {:8.2f} {:8.2f}   {:8.2f} {:8.2f}   {:+.0f} %\n", name,
             quantile(of_alone, 0.5), p95_alone, quantile(of, 0.5), p95,
             100 * (p95 / p95_alone - 1));
}

void save(const Arguments& arguments, const char* name, const Run& run) {
  if (!arguments.out.empty())
    write_trajectory(std::filesystem::path(arguments.out) / name, run.result.trajectory);
}

void compare(const Arguments& arguments, bool realtime) {
  std::vector<Effort> during, alone;
  const auto add = [](std::vector<Effort>& to, const std::vector<Effort>& more) {
    to.insert(to.end(), more.begin(), more.end());
  };
  for (int i = 0; i < (realtime ? arguments.realtime : arguments.lockstep); ++i) {
    const Run without = run(arguments, false, realtime);
    print("without loops", without);
    save(arguments, "without_loops.txt", without);
    const Run with = run(arguments, true, realtime);
    print("with loops", with);
    save(arguments, "with_loops.txt", with);
    add(during, efforts_during(with, with, realtime));
    add(alone, efforts_during(with, without, realtime));
  }
  if (alone.empty()) return;
  fmt::print("  tracking in {} frames without loops, median and p95; in {} with loops\n",
             alone.size(), during.size());
  print("ms", &Effort::milliseconds, during, alone);
  print("ms of CPU", &Effort::cpu_ms, during, alone);
  print("preempted", &Effort::switches, during, alone);
  print("pages", &Effort::pages, during, alone);
}

void measure(const Arguments& arguments) {
  if (!arguments.out.empty()) make_output_folder(arguments.out);
  if (arguments.realtime > 0) fmt::print("realtime\n");
  compare(arguments, true);
  if (arguments.lockstep > 0) fmt::print("lockstep\n");
  compare(arguments, false);
}

}  // namespace

void add_loop_cost_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("loop-cost", "measure the gain of loop closing and its cost for tracking");
  command->add_option("sequence", arguments->sequence, "folder in TUM layout with groundtruth.txt")
      ->required();
  command->add_option("--lockstep", arguments->lockstep, "number of runs in lockstep")
      ->capture_default_str();
  command->add_option("--realtime", arguments->realtime, "number of runs in real time")
      ->capture_default_str();
  command
      ->add_option("--slower", arguments->slower,
                   "factor of slow motion in real time, for a build with a sanitizer")
      ->capture_default_str();
  command->add_option("--out", arguments->out, "folder for the trajectories of the last runs");
  command->callback([arguments] { measure(*arguments); });
}

}  // namespace stillmap::lab
