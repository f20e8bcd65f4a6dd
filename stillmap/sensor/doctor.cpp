// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/doctor.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/geometry/association.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_evidence.hpp"
#include "stillmap/sensor/frame_check.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/image_sizes.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/sequence.hpp"
#include "stillmap/sensor/unlikely_camera.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

std::string short_name(const fs::path& file) {
  return (file.parent_path().filename() / file.filename()).string();
}

// Returns the value below which `share` of the values lie; 0 for no values. Reorders them.
template <typename T>
T percentile(std::vector<T>& values, double share) {
  if (values.empty()) return T{};
  const double rank = share * static_cast<double>(values.size() - 1);
  return value_of_rank(values, static_cast<std::size_t>(rank));
}

void add_error(Diagnosis& diagnosis, const Error& error) {
  const std::string where = error.where().empty() ? "" : error.where() + ": ";
  diagnosis.add(make_finding("unreadable", where + error.problem(), error.fix()));
}

// ---- camera -----------------------------------------------------------------------------------

std::optional<Camera> choose_camera(const SequencePaths& paths, const std::optional<Camera>& named,
                                    Diagnosis& diagnosis) {
  try {
    if (!named && paths.camera.empty()) {
      diagnosis.add(make_finding(
          "no-camera",
          "no camera was named and the sequence has no camera.yaml; depths below are those of a "
          "depth factor of 5000",
          "name one with --camera, or put its parameters into camera.yaml in the folder"));
      return std::nullopt;
    }
    SourceOptions options;
    options.associations = paths.associations.string();
    Camera camera = named ? *named : recorded_camera(paths.folder.string(), options);
    check_camera(camera, "camera '" + camera.name + "'");
    diagnosis.add_ok(fmt::format("camera '{}': {} x {} pixels, fx {:g}, depth factor {:g}{}",
                                 camera.name, camera.width, camera.height, camera.fx,
                                 camera.depth_factor,
                                 camera.distorted() ? ", distorted (will be rectified)" : ""));
    return camera;
  } catch (const Error& error) {
    add_error(diagnosis, error);
    return std::nullopt;
  }
}

// ---- lists and timestamps ---------------------------------------------------------------------

Severity severity_of(std::size_t unusable, std::size_t all) {
  return are_many_unusable(unusable, all) ? Severity::kUntrusted : Severity::kWarning;
}

void check_lists(const FrameList& list, Diagnosis& diagnosis) {
  diagnosis.frames = list.frames.size();
  diagnosis.add_ok(counted(list.frames.size(), "pair") + " of color and depth");
  if (list.skipped.empty()) return;
  const bool most = list.skipped.size() > list.frames.size();
  const auto lost = static_cast<std::size_t>(std::count_if(
      list.skipped.begin(), list.skipped.end(), [](const auto& s) { return s.frame_lost; }));
  const double begin = list.frames.empty() ? 0 : list.frames.front().timestamp;
  const bool many = are_many_unusable(list.skipped, begin, list.frames.size() + lost);
  diagnosis.add(with_severity(
      most   ? Severity::kError
      : many ? Severity::kUntrusted
             : Severity::kWarning,
      make_finding("bad-list",
                   fmt::format("{} of the lists without a frame; the first: {}",
                               counted(list.skipped.size(), "line"), list.skipped.front().reason),
                   most ? "correct the timestamps and names in the lists"
                        : "no action is needed if these are few: they are skipped")));
}

std::vector<double> intervals_of(const std::vector<FrameFiles>& frames) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    intervals.push_back(frames[i].timestamp - frames[i - 1].timestamp);
  }
  return intervals;
}

void check_gaps(const std::vector<FrameFiles>& frames, double median, Diagnosis& diagnosis) {
  constexpr double kGap = 3;  // Gap [median intervals]: two consecutive frames are missing.
  const auto intervals = intervals_of(frames);
  std::size_t largest = 0, gaps = 0;
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    if (intervals[i] > kGap * median) ++gaps;
    if (intervals[i] > intervals[largest]) largest = i;
  }
  if (gaps == 0) return;
  diagnosis.add(
      make_finding("timestamp-gaps",
                   fmt::format("gaps in the timestamps: {}, the longest {:.3f} s after {:.6f}",
                               gaps, intervals[largest], frames[largest].timestamp),
                   "record again with less load, or expect tracking loss there",
                   {{"gaps", static_cast<double>(gaps)}, {"longest_s", intervals[largest]}}));
}

void check_rate(const std::vector<FrameFiles>& frames, const std::optional<Camera>& camera,
                Diagnosis& diagnosis) {
  if (frames.size() < 2) return;
  auto intervals = intervals_of(frames);
  const double median = percentile(intervals, 0.5);
  diagnosis.duration = frames.back().timestamp - frames.front().timestamp;
  diagnosis.frame_rate = 1 / median;
  if (const std::string unit = unit_of_timestamps(median); !unit.empty()) {
    diagnosis.add(with_severity(
        Severity::kError,
        make_finding(
            "timestamp-unit",
            fmt::format("frames are {:g} s apart: the timestamps seem to be in {}", median, unit),
            "write the timestamps of the lists in seconds", {{"interval_s", median}})));
    return;
  }
  diagnosis.add_ok(fmt::format("{:.1f} s at {:.1f} Hz", diagnosis.duration, diagnosis.frame_rate));
  if (camera && std::abs(diagnosis.frame_rate / camera->fps - 1) > 0.2) {
    diagnosis.add(make_finding(
        "camera-rate",
        fmt::format("the camera file gives {:g} frames per second, the timestamps {:.1f}",
                    camera->fps, diagnosis.frame_rate),
        fmt::format("set fps to {:.0f} in the camera file", diagnosis.frame_rate),
        {{"given_hz", camera->fps}, {"recorded_hz", diagnosis.frame_rate}}));
  }
  check_gaps(frames, median, diagnosis);
}

void check_offsets(const std::vector<FrameFiles>& frames, Diagnosis& diagnosis) {
  // Depth delay that gives a warning [s]: half of the limit of TUM's rule.
  constexpr double kLate = 0.010;
  std::vector<double> offsets;
  for (const auto& files : frames) {
    if (!files.depth.empty()) offsets.push_back(files.depth_timestamp - files.timestamp);
  }
  if (const std::size_t without = frames.size() - offsets.size(); without > 0) {
    const bool many = 10 * without > frames.size();
    const std::string text =
        fmt::format("{} of {} {} no depth image", without, counted(frames.size(), "color image"),
                    have(frames.size()));
    if (many)
      diagnosis.add(make_finding(
          "sparse-depth", text,
          "these frames add no landmarks; record depth at the rate of the color images"));
    else
      diagnosis.add_ok(text);
  }
  diagnosis.median_offset = percentile(offsets, 0.5);
  const auto [least, most] = std::minmax_element(offsets.begin(), offsets.end());
  const std::string text =
      fmt::format("depth is {:.1f} ms {} color (median; {:.1f} to {:.1f})",
                  1e3 * std::abs(diagnosis.median_offset),
                  diagnosis.median_offset < 0 ? "before" : "after", 1e3 * *least, 1e3 * *most);
  const bool late = std::abs(diagnosis.median_offset) > kLate;
  if (!late) return diagnosis.add_ok(text);
  diagnosis.add(make_finding("depth-offset", text,
                             "correct the timestamps if this is a constant error; if the delay is "
                             "real, fast motion blurs the map",
                             {{"median_s", diagnosis.median_offset}}));
}

// ---- files ------------------------------------------------------------------------------------

// Returns a file with the same name and another extension; the list may contain the wrong one.
std::string similar_file(const fs::path& file) {
  for (const char* ending :
       {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".PNG", ".JPG", ".npy", ".exr"}) {
    std::error_code ignored;
    const fs::path other = fs::path(file).replace_extension(ending);
    if (other != file && fs::exists(other, ignored)) return short_name(other);
  }
  return "";
}

// Files with the same problem.
struct BadFiles {
  std::size_t count = 0;
  fs::path first;
  std::string fix;
};

/// A problem of a file and what to do about it; empty: none.
struct FileProblem {
  std::string problem, fix;
};

FileProblem unreadable(const fs::path& file, const std::string& problem) {
  std::error_code ignored;
  if (fs::exists(file, ignored)) {
    return {problem,
            "copy or record these files again; they are skipped (a frame without its depth image "
            "is tracked by the landmarks alone)"};
  }
  const std::string similar = similar_file(file);
  return {problem, similar.empty() ? "copy the missing files, or remove their lines from the lists"
                                   : "the list should name " + similar};
}

/// Checks the header and the end of a file.
/// @param sizes  of the images; set by the first image if not known
FileProblem file_problem(const fs::path& file, bool is_depth, std::optional<ImageSizes>& sizes) {
  const auto [header, damage] = read_image_header(file);
  if (!damage.empty()) return unreadable(file, damage);
  if (const auto problem = is_depth ? depth_problem(header) : color_problem(header);
      !problem.empty()) {
    return {problem,
            "write color as 8-bit PNG or JPEG and depth as 16-bit PNG or TIFF with one channel"};
  }
  if (!sizes) sizes = {header.size, header.size};
  const std::string problem = size_problem(header, is_depth ? sizes->depth : sizes->color);
  if (problem.empty()) return {};
  return {problem, "name the camera that recorded these images (width and height in its file)"};
}

// Checks the header and the end of every file; returns the frames with two valid files. Without
// `sizes`, the first image defines the size of all.
std::vector<FrameFiles> check_files(const std::vector<FrameFiles>& frames,
                                    std::optional<ImageSizes> sizes, Diagnosis& diagnosis) {
  std::map<std::string, BadFiles> by_problem;
  const auto is_usable = [&](const fs::path& file, bool is_depth) {
    const FileProblem found = file_problem(file, is_depth, sizes);
    if (found.problem.empty()) return true;
    BadFiles& bad = by_problem[found.problem];
    if (bad.count++ == 0) bad.first = file, bad.fix = found.fix;
    return false;
  };
  std::vector<FrameFiles> usable;
  std::size_t without_color = 0;
  for (const auto& files : frames) {
    const bool color = is_usable(files.color, /*is_depth=*/false);
    if (!color) ++without_color;
    if (files.depth.empty()) continue;
    const bool depth = is_usable(files.depth, /*is_depth=*/true);
    if (color && depth) usable.push_back(files);
  }
  diagnosis.usable_frames = usable.size();
  const Severity severity =
      usable.empty() ? Severity::kError : severity_of(without_color, frames.size());
  for (const auto& [problem, bad] : by_problem) {
    diagnosis.add(with_severity(
        severity, make_finding("bad-files",
                               fmt::format("{} file{}: {} {}", bad.count,
                                           bad.count == 1 ? "" : "s, the first",
                                           short_name(bad.first), problem),
                               bad.fix, {{"files", static_cast<double>(bad.count)}})));
  }
  if (by_problem.empty()) {
    diagnosis.add_ok(
        fmt::format("all {} image files are present, complete and of one size{}", 2 * frames.size(),
                    sizes && sizes->color != sizes->depth ? " for color and one for depth" : ""));
  }
  return usable;
}

// ---- images -----------------------------------------------------------------------------------

struct Sample {
  std::size_t decoded = 0, dark = 0, bright = 0, blurred = 0, without_depth = 0;
  std::size_t pixels = 0;
  std::vector<float> raw_depths;                        // Raw depth of every 16th known pixel.
  std::vector<bool> seen = std::vector<bool>(1 << 16);  // By raw depth.
};

void sample_color(const cv::Mat1b& gray, const DoctorOptions& options, Sample& sample) {
  cv::Mat laplacian;
  const double mean = cv::mean(gray)[0];
  if (mean < options.dark) ++sample.dark;
  if (mean > options.bright) ++sample.bright;
  // Variance of the Laplacian as a measure of focus: Pech-Pacheco et al., ICPR 2000.
  cv::Laplacian(gray, laplacian, CV_16S);
  cv::Scalar average, deviation;
  cv::meanStdDev(laplacian, average, deviation);
  if (deviation[0] * deviation[0] < options.blurred) ++sample.blurred;
}

/// Returns a depth image in raw units; floats are in meters.
cv::Mat1w raw_depth(const cv::Mat& depth, double depth_factor) {
  cv::Mat1w raw;
  depth.convertTo(raw, CV_16U, depth.type() == CV_32FC1 ? depth_factor : 1);
  return raw;
}

void sample_depth(const cv::Mat1w& raw, Sample& sample) {
  const std::size_t before = sample.raw_depths.size();
  for (const std::uint16_t value : raw) sample.seen[value] = true;
  for (int y = 0; y < raw.rows; y += 4) {
    for (int x = 0; x < raw.cols; x += 4) {
      ++sample.pixels;
      const auto value = raw.at<std::uint16_t>(y, x);
      if (value > 0 && value < 65535) sample.raw_depths.push_back(value);
    }
  }
  if (sample.raw_depths.size() == before) ++sample.without_depth;
}

Sample take_sample(const std::vector<FrameFiles>& usable, double depth_factor,
                   const DoctorOptions& options, Diagnosis& diagnosis) {
  Sample sample;
  const auto wanted =
      std::min(usable.size(), static_cast<std::size_t>(std::max(1, options.sample)));
  for (std::size_t k = 0; k < wanted; ++k) {
    const FrameFiles& files = usable[k * usable.size() / wanted];
    const auto size = [](const fs::path& file) { return read_image_header(file).header.size; };
    const ImageRead color = read_color_image(files.color, size(files.color)),
                    depth = read_depth_image(files.depth, size(files.depth));
    if (!color.problem.empty() || !depth.problem.empty()) {
      const bool color_bad = !color.problem.empty();
      diagnosis.add(make_finding("bad-files",
                                 short_name(color_bad ? files.color : files.depth) + " " +
                                     (color_bad ? color.problem : depth.problem),
                                 "copy or record this file again; it is skipped"));
      continue;
    }
    ++sample.decoded;
    cv::Mat1b gray;
    cv::cvtColor(color.image, gray, cv::COLOR_BGR2GRAY);
    sample_color(gray, options, sample);
    sample_depth(raw_depth(depth.image, depth_factor), sample);
  }
  return sample;
}

void check_light(const Sample& sample, Diagnosis& diagnosis) {
  const auto warn_if_many = [&](std::size_t count, const char* what, const char* fix) {
    if (10 * count < sample.decoded || count == 0) return;  // Up to one in ten is acceptable.
    diagnosis.add(make_finding(
        "poor-images",
        fmt::format("{} of {} sampled color images are {}", count, sample.decoded, what), fix,
        {{"images", static_cast<double>(count)}}));
  };
  warn_if_many(sample.dark, "nearly black", "record with more light or a longer exposure");
  warn_if_many(sample.bright, "nearly white", "record with a shorter exposure");
  warn_if_many(sample.blurred, "blurred or without texture",
               "move more slowly, shorten the exposure, clean the lens");
}

/// The 5th, 25th, 50th and 99th percentile of depths, in raw units or meters.
struct DepthSpread {
  double low = 0, quarter = 0, median = 0, high = 0;

  explicit DepthSpread(std::vector<float> depths)
      : low(percentile(depths, 0.05)),
        quarter(percentile(depths, 0.25)),
        median(percentile(depths, 0.5)),
        high(percentile(depths, 0.99)) {}
  DepthSpread in_meters(double factor) const {
    DepthSpread meters = *this;
    for (double* value : {&meters.low, &meters.quarter, &meters.median, &meters.high})
      *value /= factor;
    return meters;
  }
};

/// Returns why a sensor does not give these depths [m]; empty if it can. The bounds are wide, since
/// sensors read a little outside their range.
std::string implausible(const DepthSpread& depths, const DepthSensor& sensor) {
  constexpr double kNearMedian = 0.3, kNear = 0.25, kFar = 12;  // [m]
  const double nearest = std::max(sensor.min_depth, kNearMedian);
  if (depths.median < nearest || depths.median > sensor.max_depth) {
    return fmt::format(
        "the median of the depth readings is {:.2f} m, outside {:g} to {:g} m, where sensor {} "
        "measures",
        depths.median, nearest, sensor.max_depth, sensor.name);
  }
  if (depths.low < std::min(sensor.min_depth, kNear)) {
    return fmt::format(
        "a twentieth of the depth readings is below {:.2f} m, where sensor {} measures nothing",
        depths.low, sensor.name);
  }
  if (depths.quarter < sensor.min_depth) {
    return fmt::format(
        "a quarter of the depth readings is below {:.2f} m, and they are not used, since sensor {} "
        "measures nothing below {:g} m",
        depths.quarter, sensor.name, sensor.min_depth);
  }
  if (depths.high > std::max(kFar, 2 * sensor.max_depth)) {
    return fmt::format(
        "a hundredth of the depth readings is beyond {:.1f} m, where sensor {} measures nothing",
        depths.high, sensor.name);
  }
  return "";
}

/// Returns the common depth factors that give plausible depths, the likeliest first: median nearest
/// to 2 m.
std::vector<double> plausible_factors(const DepthSpread& raw, const DepthSensor& sensor) {
  std::vector<double> factors{5000, 1000, 10000, 100};
  std::erase_if(factors,
                [&](double factor) { return !implausible(raw.in_meters(factor), sensor).empty(); });
  std::ranges::stable_sort(
      factors, {}, [&](double factor) { return std::abs(std::log(raw.median / factor / 2)); });
  return factors;
}

/// Returns what to do about a wrong depth factor. Two factors may be equally likely: at 1 m a
/// camera in 0.1 mm (RealSense D405) has the readings of TUM's images at 2 m.
std::string fix_of_factor(const DepthSpread& raw, const Camera& camera) {
  constexpr std::size_t kMost = 2;  // factors named
  const auto factors = plausible_factors(raw, camera.depth_sensor);
  if (factors.empty())
    return fmt::format("check the depth factor: {:g} raw units per meter", camera.depth_factor);
  std::string fix = fmt::format("set the depth factor ({:g})", camera.depth_factor);
  for (std::size_t i = 0; i < std::min(kMost, factors.size()); ++i)
    fix += fmt::format("{} to {:g} if the median depth should be {:.2f} m", i == 0 ? "" : ", or",
                       factors[i], raw.median / factors[i]);
  return fix;
}

void check_scale(const Sample& sample, const Camera& camera, Diagnosis& diagnosis) {
  const double factor = camera.depth_factor;
  const DepthSpread raw(sample.raw_depths), meters = raw.in_meters(factor);
  const std::string text =
      fmt::format("depths: median {:.2f} m, most between {:.2f} m and {:.2f} m", meters.median,
                  meters.low, meters.high);
  diagnosis.median_depth = meters.median;
  if (const auto of_steps = depth_factor_of_steps(sample.seen, camera.depth_sensor)) {
    if (auto finding = depth_factor_finding(*of_steps, factor))
      diagnosis.add(*std::move(finding));
    else
      diagnosis.add_ok(text + ", and steps that confirm the depth factor");
    return;
  }
  const std::string problem = implausible(meters, camera.depth_sensor);
  if (problem.empty()) return diagnosis.add_ok(text);
  diagnosis.add(make_finding("depth-factor", problem, fix_of_factor(raw, camera),
                             {{"given", factor}, {"median_m", meters.median}}));
}

void check_depth(const Sample& sample, const Camera& camera, const DoctorOptions& options,
                 Diagnosis& diagnosis) {
  if (sample.pixels == 0) return;
  const auto& raw = sample.raw_depths;
  diagnosis.depth_share = static_cast<double>(raw.size()) / static_cast<double>(sample.pixels);
  if (raw.empty()) {
    return diagnosis.add(with_severity(
        Severity::kError,
        make_finding("no-depth", "the sampled depth images contain no depth",
                     "check that depth was recorded: every pixel is 0 or 65535, or of "
                     "floats, which are in meters, beyond the range")));
  }
  const bool enough = diagnosis.depth_share >= options.least_share;
  const std::string share =
      fmt::format("{:.0f} % of the pixels have depth", 100 * diagnosis.depth_share);
  if (enough)
    diagnosis.add_ok(share);
  else
    diagnosis.add(
        make_finding("sparse-depth", share,
                     "stay within the sensor's range, away from sunlight, glass and black surfaces",
                     {{"share", diagnosis.depth_share}}));
  if (sample.without_depth > 0) {
    diagnosis.add(make_finding("sparse-depth",
                               fmt::format("{} of {} sampled depth images contain no depth",
                                           sample.without_depth, sample.decoded),
                               "keep the sensor uncovered and farther than its nearest range"));
  }
  check_scale(sample, camera, diagnosis);
}

// ---- ground truth and masks -------------------------------------------------------------------

void check_jumps(const Trajectory& truth, const DoctorOptions& options, Diagnosis& diagnosis) {
  std::size_t jumps = 0, repeats = 0;
  double first = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const double seconds = truth[i].timestamp - truth[i - 1].timestamp;
    if (seconds <= 0) ++repeats;
    const double meters =
        (truth[i].T_world_camera.translation() - truth[i - 1].T_world_camera.translation()).norm();
    constexpr double kNoise = 0.02;  // Jitter of a motion capture system [m].
    if (meters <= kNoise + options.max_speed * std::max(0.0, seconds)) continue;
    if (jumps++ == 0) first = truth[i].timestamp;
  }
  if (jumps > 0) {
    diagnosis.add(make_finding(
        "truth-quality",
        fmt::format("jumps of the ground truth (faster than {1:g} m/s): {0}, the first at {2:.6f}",
                    jumps, options.max_speed, first),
        "errors measured there are errors of the ground truth"));
  }
  if (repeats > 0) {
    diagnosis.add(
        make_finding("truth-quality",
                     fmt::format("{} of the ground truth {}", counted(repeats, "timestamp"),
                                 repeats == 1 ? "repeats" : "repeat"),
                     "keep one pose per timestamp"));
  }
}

void check_ground_truth(const SequencePaths& paths, const std::vector<FrameFiles>& frames,
                        const DoctorOptions& options, Diagnosis& diagnosis) {
  if (paths.ground_truth.empty()) {
    return diagnosis.add_ok("no groundtruth.txt: the run works, but its error cannot be measured");
  }
  try {
    const Trajectory truth = read_trajectory(paths.ground_truth);
    std::vector<double> truth_stamps, stamps;
    for (const auto& pose : truth) truth_stamps.push_back(pose.timestamp);
    for (const auto& files : frames) stamps.push_back(files.timestamp);
    const auto covered = associate(stamps, truth_stamps).size();
    const double share = static_cast<double>(covered) / static_cast<double>(frames.size());
    const std::string text =
        fmt::format("ground truth: {}, {:.1f} % of the frames have one within 0.02 s",
                    counted(truth.size(), "pose"), 100 * share);
    if (covered == 0) {
      diagnosis.add(make_finding(
          "truth-quality",
          fmt::format("{}: it runs from {:.3f} to {:.3f} s, the images from {:.3f} to {:.3f} s",
                      text, truth_stamps.front(), truth_stamps.back(), stamps.front(),
                      stamps.back()),
          "use the ground truth of this recording, with timestamps of the same clock in seconds"));
    } else if (share < 0.9) {
      diagnosis.add(
          make_finding("truth-quality", text, "errors will be measured on these frames only"));
    } else {
      diagnosis.add_ok(text);
    }
    check_jumps(truth, options, diagnosis);
  } catch (const Error& error) {
    diagnosis.add(unreadable_truth(error));
  }
}

void check_masks(const SequencePaths& paths, const std::vector<FrameFiles>& frames,
                 Diagnosis& diagnosis) {
  if (paths.masks.empty()) return;
  std::error_code ignored;
  const auto present = std::count_if(frames.begin(), frames.end(), [&](const FrameFiles& files) {
    return fs::exists(paths.masks / files.color.stem().concat(".png"), ignored);
  });
  const bool all = static_cast<std::size_t>(present) == frames.size();
  const std::string text =
      fmt::format("mask/ holds masks for {} of {}", present, counted(frames.size(), "frame"));
  if (all)
    diagnosis.add_ok(text);
  else
    diagnosis.add(make_finding(
        "mask-files", text, "give each mask the name of its color image, with the extension .png"));
}

/// Adds what the first frames of a source show together; returns their number.
std::size_t check_frames(FrameSource& source, std::size_t most_frames, Diagnosis& diagnosis) {
  FrameCheck check(source.camera());
  std::size_t frames = 0;
  for (; frames < most_frames; ++frames) {
    const RgbdFramePtr frame = source.next();
    if (!frame) break;
    check.add(*frame);
  }
  const std::string examined = counted(frames, "frame") + " examined";
  if (frames > 0)
    diagnosis.add_ok(examined);
  else
    diagnosis.add(make_finding("no-frames", examined));
  for (Finding& finding : check.findings()) diagnosis.add(std::move(finding));
  if (auto finding = unlikely_camera_finding(source.camera())) diagnosis.add(*std::move(finding));
  return frames;
}

/// Returns the finding that the frames are not in the order of the numbers in the names of their
/// color images, such as those of a list that was sorted as text; none if they are, or if the names
/// are not one text with different numbers at the end.
std::optional<Finding> order_finding(const std::vector<FrameFiles>& frames) {
  constexpr std::size_t kFewest = 3, kPerStep = 33;  // steps back, frames per step back
  std::string common;
  double last = 0;
  std::size_t back = 0;
  std::string example;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string stem = frames[i].color.stem().string();
    const std::size_t begin = stem.find_last_not_of("0123456789.") + 1;
    if (begin == stem.size() || (i > 0 && stem.substr(0, begin) != common)) return std::nullopt;
    common = stem.substr(0, begin);
    const auto leading = leading_number(std::string_view(stem).substr(begin));
    const double number = leading ? leading->value : 0;
    if (i > 0 && number < last && back++ == 0)
      example = fmt::format("{} follows {}", frames[i].color.filename().string(),
                            frames[i - 1].color.filename().string());
    last = number;
  }
  if (back < kFewest || kPerStep * back < frames.size()) return std::nullopt;
  return make_finding(
      "image-order",
      fmt::format("the frames are not in the order of the numbers of their images ({}), as if the "
                  "list had been sorted as text",
                  example),
      "give the images the times at which they were taken");
}

void examine(const SequencePaths& paths, const std::optional<Camera>& named,
             const DoctorOptions& options, Diagnosis& diagnosis) {
  const auto camera = choose_camera(paths, named, diagnosis);
  const FrameList list = list_frames(paths);
  check_lists(list, diagnosis);
  if (auto finding = order_finding(list.frames)) diagnosis.add(*std::move(finding));
  check_rate(list.frames, camera, diagnosis);
  check_offsets(list.frames, diagnosis);
  std::optional<ImageSizes> sizes;
  if (camera) sizes = {color_size(list.frames, *camera), {camera->width, camera->height}};
  const auto usable = check_files(list.frames, sizes, diagnosis);
  const Camera assumed = camera.value_or(Camera());
  Sample sample = take_sample(usable, assumed.depth_factor, options, diagnosis);
  check_light(sample, diagnosis);
  check_depth(sample, assumed, options, diagnosis);
  check_ground_truth(paths, list.frames, options, diagnosis);
  check_masks(paths, list.frames, diagnosis);
  if (!camera || diagnosis.conclusion() == Severity::kError) return;
  SourceOptions range;
  range.recorded = camera;
  range.associations = paths.associations.string();
  const auto source = make_source(paths.folder.string(), range);
  for (const std::string& note : source->notes()) diagnosis.add_ok(note);
  for (Finding& finding : source->findings()) diagnosis.add(std::move(finding));
  check_frames(*source, options.most_frames, diagnosis);
}

}  // namespace

void Diagnosis::add(Finding finding) {
  const bool known = std::any_of(findings.begin(), findings.end(),
                                 [&](const Finding& f) { return f.message == finding.message; });
  if (!known) findings.push_back(std::move(finding));
}

void Diagnosis::add_ok(std::string message) { add({.message = std::move(message)}); }

Finding unreadable_truth(const Error& reason) {
  return make_finding(
      "truth-quality",
      fmt::format("the ground truth cannot be read, so errors are not measured: {}: {}",
                  reason.where(), reason.problem()),
      "remove or rename the file, or correct it" +
          (reason.fix().empty() ? "" : ": " + reason.fix()));
}

Diagnosis diagnose(FrameSource& source, std::size_t most_frames) {
  Diagnosis diagnosis;
  for (const std::string& note : source.notes()) diagnosis.add_ok(note);
  for (Finding& finding : source.findings()) diagnosis.add(std::move(finding));
  diagnosis.frames = diagnosis.usable_frames = check_frames(source, most_frames, diagnosis);
  if (!source.skipped().empty()) {
    diagnosis.add(make_finding("bad-files", fmt::format("skipped: {}; the first: {}",
                                                        counted(source.skipped().size(), "image"),
                                                        source.skipped().front().reason)));
  }
  return diagnosis;
}

std::optional<Finding> order_finding(const fs::path& folder, const fs::path& associations) {
  return order_finding(list_frames(find_sequence(folder, associations)).frames);
}

std::optional<Finding> depth_unit_finding(const fs::path& folder, const Camera& camera,
                                          const fs::path& associations) {
  constexpr std::size_t kImages = 8;
  const auto frames = list_frames(find_sequence(folder, associations)).frames;
  Sample sample;
  for (std::size_t i = 0; i < std::min(kImages, frames.size()); ++i) {
    const FrameFiles& files = frames[i * frames.size() / std::min(kImages, frames.size())];
    if (files.depth.empty()) continue;
    const ImageRead depth =
        read_depth_image(files.depth, read_image_header(files.depth).header.size);
    if (depth.problem.empty()) sample_depth(raw_depth(depth.image, camera.depth_factor), sample);
  }
  if (sample.raw_depths.empty()) return std::nullopt;
  const std::string problem = implausible(
      DepthSpread(sample.raw_depths).in_meters(camera.depth_factor), camera.depth_sensor);
  if (problem.empty()) return std::nullopt;
  return make_finding("depth-factor", problem,
                      fmt::format("check the depth factor ({:g} units per meter) with: stillmap "
                                  "doctor {}",
                                  camera.depth_factor, folder.string()),
                      {{"given", camera.depth_factor}});
}

Diagnosis diagnose(const fs::path& folder, const std::optional<Camera>& camera,
                   const fs::path& associations, const DoctorOptions& options) {
  Diagnosis diagnosis;
  try {
    examine(find_sequence(folder, associations), camera, options, diagnosis);
  } catch (const Error& error) {
    add_error(diagnosis, error);
  }
  return diagnosis;
}

}  // namespace stillmap
