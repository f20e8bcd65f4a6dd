// SPDX-License-Identifier: Apache-2.0
/// What closing loops gains, and what it costs:
///
///     ninja -C build/release stillmap_loop_cost
///     build/release/rooms/pipeline/stillmap_loop_cost SEQUENCE [--lockstep N] [--realtime N]
///                                                     [--slower FACTOR] [--out DIR]
///
/// A sequence with ground truth is mapped without and with loop closing, by turns: N times (1) in
/// lockstep, which is as fast as it goes, and N times (3) as if it came from a camera. Printed: ATE
/// and coverage; for every loop or merge what was moved, and the milliseconds for the pose graph,
/// for all that the map's thread did then, and for the adjustment of the whole in its own thread;
/// and tracking in the frames that came while that went on, beside the same frames without loops:
/// milliseconds by the clock and of a processor, how often a processor was taken away, and pages
/// fetched, in the median and at the 95th percentile. If a processor's time rises with the clock's
/// there is more to do or memory is slow; if not, the thread waits. DIR gets the trajectories of
/// the last runs. FACTOR: of slow motion, for a build with a sanitizer.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/paced_source.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/slam.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <numbers>
#include <sys/resource.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

struct Arguments {
  std::string sequence, out;
  int lockstep = 1, realtime = 3;  ///< runs
  double slower = 1;
};

/// What the calling thread has used so far.
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

/// What one frame took of the tracking thread.
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
      std::make_unique<TumFolder>(paths, load_camera(paths.camera.string())), 4,
      realtime ? ThreadPriority::kNone : ThreadPriority::kBackground);
  PacedSource* paced = nullptr;
  if (realtime) {
    auto wrapped = std::make_unique<PacedSource>(std::move(source), arguments.slower);
    paced = wrapped.get();
    source = std::move(wrapped);
  }
  SlamOptions options;
  options.places.loops = loops;
  options.schedule.mode = realtime ? "realtime" : "lockstep";
  Slam slam(source->camera(), options);
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
    made.efforts[i].milliseconds = made.result.frames[i].milliseconds;
  made.dropped = paced != nullptr ? paced->dropped() : 0;
  made.fps = source->camera().fps;
  made.ate = absolute_trajectory_error(read_trajectory(paths.ground_truth), made.result.trajectory)
                 .translation.rmse;
  return made;
}

/// What happened at each loop, with the adjustment that followed it.
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

void print(const char* what, const Run& run) {
  fmt::print("{}: ATE {:.4f} m, {} of {} frames tracked, {} dropped late, {} keyframes, {} maps\n",
             what, run.ate, run.result.tracked(), run.result.frames.size() + run.dropped,
             run.dropped, run.result.keyframes.size(), run.result.maps);
  for (const Closing& c : closings(run.result)) {
    const MapEvent& e = c.event;
    fmt::print(
        "  {}: frame {} shows the place of frame {}: {} landmarks agree, {} fused, moved by "
        "{:.3f} m and {:.2f} degrees; {} keyframes: pose graph {:.0f} ms, in all {:.0f} ms, "
        "adjustment of the whole {:.0f} ms\n",
        e.kind == MapEvent::Kind::kLoop ? "loop" : "merge", e.frame_index, e.seen_in, e.inliers,
        e.fused, e.meters, e.radians * 180 / std::numbers::pi, e.keyframes, e.graph_ms,
        e.milliseconds, c.adjustment_ms);
  }
}

/// The frames from a loop's keyframe until the adjustment was done, or in lockstep taken in.
bool was_beside(const Closing& c, std::size_t frame, double fps, bool realtime) {
  constexpr double kRefining = 150;  // ms from the keyframe to the loop, and from there to the copy
  if (frame < c.event.frame_index) return false;
  const auto since = static_cast<double>(frame - c.event.frame_index);
  if (!realtime) return since <= ScheduleOptions{}.global_delay;
  return since <= (kRefining + c.event.milliseconds + c.adjustment_ms) / 1000 * fps;
}

/// Tracking in the frames that came while loops were closed in the run `closed`.
std::vector<Effort> efforts_beside(const Run& closed, const Run& measured, bool realtime) {
  const auto all = closings(closed.result);
  std::vector<Effort> efforts;
  for (std::size_t i = 0; i < measured.efforts.size(); ++i) {
    const auto beside = [&](const Closing& c) {
      return was_beside(c, measured.result.frames[i].index, closed.fps, realtime);
    };
    if (std::any_of(all.begin(), all.end(), beside)) efforts.push_back(measured.efforts[i]);
  }
  return efforts;
}

void print(const char* what, double Effort::*part, const std::vector<Effort>& beside,
           const std::vector<Effort>& alone) {
  const auto samples = [&](const std::vector<Effort>& efforts) {
    std::vector<double> values;
    for (const Effort& effort : efforts) values.push_back(effort.*part);
    return values;
  };
  const auto of = samples(beside), of_alone = samples(alone);
  const double p95 = quantile(of, 0.95), p95_alone = quantile(of_alone, 0.95);
  fmt::print("  {:10} {:8.2f} {:8.2f}   {:8.2f} {:8.2f}   {:+.0f} %\n", what,
             quantile(of_alone, 0.5), p95_alone, quantile(of, 0.5), p95,
             100 * (p95 / p95_alone - 1));
}

void save(const Arguments& arguments, const char* name, const Run& run) {
  if (!arguments.out.empty())
    write_trajectory(std::filesystem::path(arguments.out) / name, run.result.trajectory);
}

void compare(const Arguments& arguments, bool realtime) {
  std::vector<Effort> beside, alone;
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
    add(beside, efforts_beside(with, with, realtime));
    add(alone, efforts_beside(with, without, realtime));
  }
  if (alone.empty()) return;
  fmt::print("  tracking in {} frames without loops, median and p95; in {} beside them\n",
             alone.size(), beside.size());
  print("ms", &Effort::milliseconds, beside, alone);
  print("ms of CPU", &Effort::cpu_ms, beside, alone);
  print("preempted", &Effort::switches, beside, alone);
  print("pages", &Effort::pages, beside, alone);
}

void measure(const Arguments& arguments) {
  if (!arguments.out.empty()) make_output_folder(arguments.out);
  if (arguments.realtime > 0) fmt::print("realtime\n");
  compare(arguments, true);
  if (arguments.lockstep > 0) fmt::print("lockstep\n");
  compare(arguments, false);
}

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--lockstep" && i + 1 < argc) {
      arguments.lockstep = std::stoi(argv[++i]);
    } else if (word == "--realtime" && i + 1 < argc) {
      arguments.realtime = std::stoi(argv[++i]);
    } else if (word == "--slower" && i + 1 < argc) {
      arguments.slower = std::stod(argv[++i]);
    } else if (word == "--out" && i + 1 < argc) {
      arguments.out = argv[++i];
    } else {
      arguments.sequence = word;
    }
  }
  if (arguments.sequence.empty())
    throw Error("no sequence was named", "", "name a folder with groundtruth.txt");
  return arguments;
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  cv::setNumThreads(1);  // as the command does
  try {
    stillmap::measure(stillmap::parse(argc, argv));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
