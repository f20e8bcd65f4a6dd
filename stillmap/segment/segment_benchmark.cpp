// Two tables. `network/...`: back end or device x network x threads with the time per frame of
// detection and mask [ms] (wall time: `ms`, `ms_p95`, `ms_min`; CPU time of all threads, which
// depends less on other programs: `cpu_ms`, `cpu_ms_p95`), the coverage of people compared with
// true masks, and the IoU with the masks of the same network on the fastest back end of the CPU
// ("same"). `propagate/...`: the same for masks propagated over a number of frames.
//
// Networks are read from $STILLMAP_SHARED/models, sequences in TUM layout with a folder `mask` (255
// = person) from $STILLMAP_BENCH; missing ones are skipped.
#include "stillmap/base/error.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/segment/accelerator.hpp"
#include "stillmap/segment/dynamic_mask.hpp"
#include "stillmap/segment/inference_engine.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/segment/mask_folder.hpp"
#include "stillmap/segment/mask_propagator.hpp"
#include "stillmap/segment/segment_options.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <cstdlib>
#include <ctime>
#include <filesystem>

#include <benchmark/benchmark.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

fs::path folder_from(const char* variable, const char* otherwise) {
  const char* folder = std::getenv(variable);
  return folder != nullptr ? folder : otherwise;
}

std::vector<fs::path> files_in(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  if (!fs::is_directory(folder)) return files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Intersection and union of detected and true pixels, summed over frames; and the share of frames
/// with people of whom more than a fifth was missed.
struct Overlap {
  double both = 0, found = 0, truth = 0;
  double frames = 0, poor = 0;
  void add(const cv::Mat1b& found_mask, const cv::Mat1b& true_mask) {
    const double shared = cv::countNonZero(found_mask & true_mask);
    const double true_area = cv::countNonZero(true_mask);
    both += shared;
    found += cv::countNonZero(found_mask);
    truth += true_area;
    frames += true_area > 0 ? 1 : 0;
    poor += shared < 0.8 * true_area ? 1 : 0;
  }
  void report(benchmark::State& state) const {
    state.counters["poor"] = poor / frames;
    state.counters["recall"] = both / truth;
    state.counters["precision"] = both / found;
    state.counters["IoU"] = iou();
  }
  double iou() const { return both / (found + truth - both); }
};

/// A frame with its true mask of people.
struct Sample {
  RgbdFramePtr frame;
  cv::Mat1b truth;
};

Sample read_sample(const fs::path& sequence, const fs::path& color_file, std::size_t index) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->index = index;
  frame->timestamp = std::stod(color_file.stem().string());
  frame->color = read_stored_image(color_file).image;
  cv::cvtColor(frame->color, frame->gray, cv::COLOR_BGR2GRAY);
  const fs::path depth = sequence / "depth" / color_file.filename();
  read_stored_image(depth).image.convertTo(frame->depth, CV_32F, 1.0 / 5000);
  const cv::Mat mask = read_stored_image(sequence / "mask" / color_file.filename()).image;
  return {frame, mask == 255};
}

/// Returns runs of `length` consecutive frames, spread over all sequences with people.
std::vector<std::vector<Sample>> read_runs(std::size_t per_sequence, std::size_t length) {
  std::vector<std::vector<Sample>> runs;
  const fs::path bench = folder_from("STILLMAP_BENCH", STILLMAP_BENCH_DEFAULT);
  if (!fs::is_directory(bench)) return runs;
  std::vector<fs::path> sequences;
  for (const auto& entry : fs::directory_iterator(bench)) sequences.push_back(entry.path());
  std::sort(sequences.begin(), sequences.end());
  for (const auto& sequence : sequences) {
    if (!fs::is_directory(sequence / "mask")) continue;
    const auto files = files_in(sequence / "rgb", ".png");
    if (files.size() < per_sequence * length) continue;
    for (std::size_t r = 0; r < per_sequence; ++r) {
      const std::size_t first = (2 * r + 1) * files.size() / (2 * per_sequence);
      std::vector<Sample> run;
      for (std::size_t i = first; i < std::min(first + length, files.size()); ++i) {
        run.push_back(read_sample(sequence, files[i], i));
      }
      runs.push_back(std::move(run));
    }
  }
  return runs;
}

/// Returns the value below which a share of the values lies; 0 if there are none.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto index = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index),
                   values.end());
  return values[index];
}

/// Returns the CPU time that all threads of the process have used [ms].
double process_cpu_milliseconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Times per frame [ms].
struct Times {
  std::vector<double> wall, cpu;

  template <typename Work>
  auto measure(const Work& work) {
    const Stopwatch watch;
    const double before = process_cpu_milliseconds();
    auto result = work();
    cpu.push_back(process_cpu_milliseconds() - before);
    wall.push_back(watch.milliseconds());
    return result;
  }
  void report(benchmark::State& state) const {
    constexpr double kMost = 0.95;
    state.counters["ms"] = quantile(wall, 0.5);
    state.counters["ms_p95"] = quantile(wall, kMost);
    state.counters["ms_min"] = quantile(wall, 0);
    state.counters["cpu_ms"] = quantile(cpu, 0.5);
    state.counters["cpu_ms_p95"] = quantile(cpu, kMost);
  }
};

const std::vector<std::vector<Sample>>& network_samples() {
  static const auto kRuns = read_runs(8, 1);
  return kRuns;
}

cv::Mat1b mask_of_people(Detector& detector, const Sample& sample) {
  SegmentedFrame found;
  found.instances = detector.detect(*sample.frame);
  return dynamic_mask(found, {"person"}, sample.truth.size());
}

/// Returns the masks of all samples by a network on the fastest back end of the CPU.
const std::vector<cv::Mat1b>& reference_masks(const std::string& model) {
  static std::map<std::string, std::vector<cv::Mat1b>> made;
  auto& masks = made[model];
  if (!masks.empty()) return masks;
  SegmentOptions options;
  options.model = model;
  options.device = "cpu";
  const auto detector = make_detector(options);
  for (const auto& run : network_samples()) masks.push_back(mask_of_people(*detector, run.front()));
  return masks;
}

void run_network(benchmark::State& state, const SegmentOptions& options) {
  if (network_samples().empty()) return state.SkipWithError("no sequences with masks");
  try {
    cv::setNumThreads(options.threads);  // Thread pool of the OpenCV back end.
    const auto detector = make_detector(options);
    const auto& reference = reference_masks(options.model);
    Times times;
    Overlap overlap, same;
    for (auto _ : state) {
      for (std::size_t i = 0; i < reference.size(); ++i) {
        const Sample& sample = network_samples()[i].front();
        const cv::Mat1b mask = times.measure([&] { return mask_of_people(*detector, sample); });
        overlap.add(mask, sample.truth);
        same.add(mask, reference[i]);
      }
    }
    times.report(state);
    overlap.report(state);
    state.counters["same"] = same.iou();
  } catch (const Error& e) {
    state.SkipWithError(e.problem().c_str());
  }
}

void register_network(const std::string& name, const SegmentOptions& options) {
  const std::string full_name = "network/" + name + "/" + fs::path(options.model).stem().string() +
                                "/threads:" + std::to_string(options.threads);
  benchmark::RegisterBenchmark(full_name.c_str(), run_network, options)->Iterations(1);
}

void register_networks() {
  const fs::path shared = folder_from("STILLMAP_SHARED", STILLMAP_SHARED_DEFAULT);
  for (const auto& model : files_in(shared / "models", ".onnx")) {
    SegmentOptions options;
    options.model = model;
    for (options.threads = 1; options.threads <= 2; ++options.threads) {
      options.device = "cpu";
      for (const auto& backend : available_backends()) {
        options.backend = backend;
        register_network(backend, options);
      }
    }
    options.threads = 1;
    options.backend = "auto";
    for (const char* device : {"tensorrt", "cuda", "intel-gpu", "npu"}) {
      options.device = device;
      if (missing_hardware(device).empty()) register_network(device, options);
    }
  }
}

const std::vector<std::vector<Sample>>& propagation_samples() {
  static const auto kRuns = read_runs(8, 7);
  return kRuns;
}

/// Returns the masks of the first frame of each run: true ones or a network's.
std::vector<SegmentedFramePtr> first_masks(const std::string& model) {
  std::unique_ptr<Detector> detector;
  SegmentOptions options;
  options.model = model;
  if (!model.empty()) detector = make_detector(options);
  std::vector<SegmentedFramePtr> all;
  for (const auto& run : propagation_samples()) {
    auto masks = std::make_shared<SegmentedFrame>();
    masks->frame_index = masks->source_index = run.front().frame->index;
    masks->instances =
        detector ? detector->detect(*run.front().frame) : instances_of_mask(run.front().truth);
    std::erase_if(masks->instances, [](const Instance& i) { return i.class_name != "person"; });
    all.push_back(masks);
  }
  return all;
}

/// Propagates the first masks of each run to its frame `age`. New masks (age 0) are processed by
/// trim_by_depth().
void run_carry(benchmark::State& state, const std::string& model, std::size_t age) {
  if (propagation_samples().empty()) return state.SkipWithError("no sequences with masks");
  const auto masks = first_masks(model);
  Times times;
  Overlap overlap;
  for (auto _ : state) {
    for (std::size_t r = 0; r < masks.size(); ++r) {
      const auto& run = propagation_samples()[r];
      const Sample& target = run.at(age);
      MaskPropagator propagator(30);
      propagator.push(run.front().frame);
      propagator.set(*masks[r]);
      const SegmentedFrame propagated = times.measure([&] {
        propagator.push(target.frame);
        return age > 0 ? *propagator.current() : trim_by_depth(*masks[r], *run.front().frame);
      });
      overlap.add(dynamic_mask(propagated, {"person"}, target.truth.size()), target.truth);
    }
  }
  times.report(state);
  overlap.report(state);
}

void register_carrying() {
  const fs::path shared = folder_from("STILLMAP_SHARED", STILLMAP_SHARED_DEFAULT);
  const std::string network = shared / "models/yolo11n-seg_256x320.onnx";
  for (const std::string& model : {std::string(), network}) {
    if (!model.empty() && !fs::exists(model)) continue;
    for (const std::size_t age : {0, 1, 2, 3, 4, 6}) {
      const auto name = std::string("propagate/") +
                        (model.empty() ? "true mask" : "network's mask") +
                        "/age:" + std::to_string(age);
      benchmark::RegisterBenchmark(name.c_str(), run_carry, model, age)->Iterations(1);
    }
  }
}

const bool kRegistered = [] {
  register_networks();
  register_carrying();
  return true;
}();

}  // namespace
}  // namespace stillmap
