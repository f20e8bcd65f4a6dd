// SPDX-License-Identifier: Apache-2.0
// `stillmap record`: keeps the frames of a source as a folder in TUM layout.
#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/frame_check.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/motion_files.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "command_tree.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#include "progress.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct RecordArguments {
  std::string source, out;
  std::optional<double> follow;
  SourceOptions options;
};

constexpr double kLargestValue = 65534;  // of a 16-bit depth image; 65535 means "too far"

/// Returns the camera of the written images: its depth factor is that of the source, or the largest
/// of the usual ones with which the range of the sensor fits into 16 bits.
Camera written_camera(Camera camera) {
  for (const double factor : {camera.depth_factor, 5000.0, 1000.0, 100.0}) {
    camera.depth_factor = factor;
    if (factor * camera.depth_sensor.max_depth <= kLargestValue) break;
  }
  return camera;
}

/// A folder in TUM layout that grows frame by frame. The line of an image follows its file, so that
/// `stillmap run --follow` can read the folder meanwhile.
class FolderWriter {
 public:
  /// Throws Error if the folder exists and is not empty, or cannot be written.
  FolderWriter(const fs::path& folder, const Camera& camera) : folder_(folder), camera_(camera) {
    std::error_code failed;
    if (fs::exists(folder, failed) && !fs::is_empty(folder, failed))
      throw Error("is not empty", folder.string(), "name a new folder");
    for (const char* kind : {"rgb", "depth"}) {
      fs::create_directories(folder / kind, failed);
      if (failed)
        throw Error("cannot be created (" + failed.message() + ")", folder.string(),
                    "name a writable folder");
    }
    if (camera_.imu) camera_.imu->time_offset = 0;  // frames have samples by their own clock
    write_camera(folder / "camera.yaml", camera_);
    color_list_.open(folder / "rgb.txt");
    depth_list_.open(folder / "depth.txt");
  }

  const Camera& camera() const { return camera_; }

  void add(const RgbdFrame& frame) {
    if (!frame.ignored.empty() && camera_.ignore.empty()) keep_ignored(frame.ignored);
    for (const ImuSample& sample : frame.imu)
      if (samples_.imu.empty() || sample.timestamp > samples_.imu.back().timestamp)
        samples_.imu.push_back(sample);
    for (const OdometrySample& sample : frame.odometry)
      if (samples_.odometry.empty() || sample.timestamp > samples_.odometry.back().timestamp)
        samples_.odometry.push_back(sample);
    write(frame.color, "rgb", frame.timestamp, color_list_);
    if (cv::countNonZero(frame.depth) == 0) return;
    cv::Mat raw;
    frame.depth.convertTo(raw, CV_16UC1, camera_.depth_factor);
    write(raw, "depth", frame.timestamp + frame.depth_delay, depth_list_);
  }

  /// Writes the samples of the IMU and the wheels, if the frames have any. Called after the last
  /// frame.
  void finish() const {
    if (!samples_.imu.empty()) write_imu(folder_ / "imu.csv", samples_.imu);
    if (!samples_.odometry.empty()) write_odometry(folder_ / "odometry.txt", samples_.odometry);
  }

 private:
  void keep_ignored(const cv::Mat& pixels) {
    camera_.ignore = (folder_ / "ignore.png").string();
    write_png(camera_.ignore, pixels);
    write_camera(folder_ / "camera.yaml", camera_);
  }

  void write(const cv::Mat& image, const char* kind, double stamp, std::ofstream& list) const {
    const std::string name = fmt::format("{}/{:.9f}.png", kind, stamp);
    write_png(folder_ / name, image);
    list << fmt::format("{:.9f} {}\n", stamp, name) << std::flush;
    if (!list) throw Error("a list cannot be written", folder_.string(), "free space on the disk");
  }

  fs::path folder_;
  Camera camera_;
  std::ofstream color_list_, depth_list_;
  MotionSamples samples_;
};

/// Tells what a folder keeps of its source, which cannot be restored from it.
std::string kept_text(const Camera& camera) {
  constexpr double kMillimeters = 1000;  // per meter
  return fmt::format(
      "kept: color without distortion, depth registered to color from {:g} to {:g} m in steps of "
      "{:g} mm; not kept: images as the camera took them\n",
      camera.depth_sensor.min_depth, camera.depth_sensor.max_depth,
      kMillimeters / camera.depth_factor);
}

/// Writes and checks the frames of a source. Returns their number.
std::size_t add_frames(FrameSource& source, FolderWriter& writer, FrameCheck& check) {
  Progress progress("recording", source.size());
  std::size_t frames = 0;
  for (; !interrupted(); ++frames) {
    const RgbdFramePtr frame = source.next();
    if (!frame) break;
    writer.add(*frame);
    check.add(*frame);
    progress.step("");
  }
  return frames;
}

int record(const RecordArguments& arguments) {
  catch_interrupt();
  SourceOptions options = arguments.options;
  if (arguments.follow || names_live_camera(arguments.source)) {
    options.following = {.patience = arguments.follow.value_or(Following{}.patience),
                         .stop = interrupted};
  }
  const auto source = make_source(arguments.source, options);
  for (const std::string& note : source->notes()) print_out("{}\n", note);
  FolderWriter writer(arguments.out, written_camera(source->camera()));
  FrameCheck check(source->camera());
  const std::size_t frames = add_frames(*source, writer, check);
  writer.finish();
  print_out("{}: {}, {} skipped\n{}", arguments.out, counted(frames, "frame"),
            source->skipped().size(), kept_text(writer.camera()));
  std::vector<Finding> findings = source->findings();
  append(check.findings(), findings);
  const std::size_t skipped = source->skipped().size();
  if (are_many_unusable(skipped, frames + skipped)) {
    findings.push_back(
        make_finding("unusable-frames",
                     fmt::format("{} of {} frames could not be used", skipped, frames + skipped),
                     "look for the cause with: stillmap doctor " + arguments.source));
  }
  const int code = print_findings(findings);
  return interrupted() ? kInterrupted : code;
}

}  // namespace

void add_record_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<RecordArguments>();
  SourceOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand(
      "record", "keep the frames of a recording or of a growing folder as a folder in TUM layout");
  command
      ->add_option("source", arguments->source,
                   "as for run: a recorded file, a folder, a stereo pair, or realsense:")
      ->required();
  command->add_option("out", arguments->out, "new folder")->required();
  command->add_option("--camera", options.camera, "preset name or camera file")
      ->type_name(names_or_file(camera_presets()));
  command
      ->add_option("--ignore", options.ignore, "image whose white pixels are ignored, as for run")
      ->type_name("FILE");
  command
      ->add_option("--rotate", options.rotate,
                   "turn the images clockwise by 90, 180 or 270 degrees, as for run")
      ->type_name("DEGREES");
  command->add_option("--topics", options.topics,
                      "COLOR,DEPTH or LEFT,RIGHT: topics of a recorded file");
  command->add_option("--fps", options.fps,
                      "rate of images whose names are numbers, not times [Hz]");
  command->add_option("--first", options.first, "number of frames to skip at the start");
  command->add_option("--count", options.count, "maximum number of frames; 0: all");
  command->add_option("--stride", options.stride, "use every n-th frame");
  command
      ->add_option("--follow", arguments->follow,
                   "the folder still grows: wait for images until none has come for this time [s]")
      ->expected(0, 1)
      ->default_str("5");
  add_quiet_option(*command);
  command->footer(
      "Images are written rectified, depth registered to color and in 16 bits, with camera.yaml.\n"
      "Depths outside the range of the camera's sensor are not kept: name the right camera first.\n"
      "Example:\n  stillmap record robot.mcap my_sequence --count 300");
  command->callback([arguments, &exit_code] { exit_code = record(*arguments); });
}

}  // namespace stillmap
