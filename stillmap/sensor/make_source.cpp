// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/make_source.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/converted_source.hpp"
#include "stillmap/sensor/followed_folder.hpp"
#include "stillmap/sensor/halved.hpp"
#include "stillmap/sensor/image_sizes.hpp"
#include "stillmap/sensor/inertial_source.hpp"
#include "stillmap/sensor/live_source.hpp"
#include "stillmap/sensor/motion_check.hpp"
#include "stillmap/sensor/motion_files.hpp"
#include "stillmap/sensor/realsense_camera.hpp"
#include "stillmap/sensor/recording_source.hpp"
#include "stillmap/sensor/rotated.hpp"
#include "stillmap/sensor/stereo_folder.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <filesystem>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kForms =
    "name a recording: FILE.bag, FILE.db3, FILE.mcap, a folder in TUM layout (rgb.txt, "
    "depth.txt) as FOLDER or tum:FOLDER, or the camera realsense:";
constexpr std::string_view kTum = "tum:", kRealsense = "realsense:";

/// The folder that the text names. Only a text of the form "word:..." can name anything else; a
/// folder may have a colon in its name, too.
std::string folder_of(const std::string& text) {
  if (text.empty()) throw Error("no source of frames was named", "make_source", kForms);
  if (text.starts_with(kTum)) return text.substr(kTum.size());
  if (text.starts_with(kRealsense)) return text;
  const auto colon = text.find(':');
  const bool scheme = colon != std::string::npos && colon > 1 && text.find('/') > colon &&
                      !std::filesystem::exists(text);
  if (scheme) {
    throw Error(fmt::format("there is no kind of source '{}'", text.substr(0, colon)),
                "make_source", kForms);
  }
  return text;
}

/// Returns whether the text names a file, or a folder with files of rosbag2.
bool names_recording(const std::string& text) {
  const std::filesystem::path path = folder_of(text);
  std::error_code ignored;
  return !text.starts_with(kTum) && is_recording(path) &&
         !std::filesystem::exists(path / "rgb.txt", ignored);
}

/// Returns the camera with `ignore` of the options, if given.
Camera with_ignored(Camera camera, const SourceOptions& options) {
  if (!options.ignore.empty()) camera.ignore = options.ignore;
  return camera;
}

/// Returns whether the options give the camera, so that the source need not contain one.
bool give_camera(const SourceOptions& options) {
  return options.recorded || !options.camera.empty();
}

/// Returns the camera that the options give for a recorded file; none to use that of the recording.
std::optional<Camera> given_camera(const std::string& path, const SourceOptions& options) {
  if (options.recorded) return with_ignored(*options.recorded, options);
  if (options.camera.empty()) return std::nullopt;
  const auto image_size = [&]() -> std::optional<cv::Size> {
    Recording recording(path);
    const ImageStream color = find_rgbd_streams(recording, options.topics).color;
    if (color.width == 0) return std::nullopt;
    return cv::Size(color.width, color.height);
  };
  return with_ignored(read_camera(options.camera, image_size), options);
}

/// Returns the preset of the data set to which a folder belongs by its name or layout; otherwise
/// empty.
std::string guessed_camera(const SequencePaths& paths) {
  const std::string by_name = camera_of_dataset(paths.folder);
  return by_name.empty() && paths.layout == FolderLayout::kSevenScenes ? "seven_scenes" : by_name;
}

/// Returns the given camera, or that of the folder.
/// @param sizes  used if the camera file does not contain the size of the images
Camera named_camera(const SourceOptions& options, const SequencePaths& paths,
                    const std::optional<ImageSizes>& sizes) {
  const auto image_size = [&] { return sizes ? std::optional(sizes->color) : std::nullopt; };
  if (options.recorded) return *options.recorded;
  if (!options.camera.empty()) return read_camera(options.camera, image_size);
  if (!paths.camera.empty()) return read_camera(paths.camera.string(), image_size);
  if (const std::string guess = guessed_camera(paths); !guess.empty()) return read_camera(guess);
  throw Error("the sequence has no camera.yaml, and no camera was named", paths.folder.string(),
              fmt::format("add --camera NAME or FILE; the names are {}",
                          fmt::join(camera_presets(), ", ")));
}

/// Returns the sizes of the images of a folder; none if no pair of them can be read.
std::optional<ImageSizes> sizes_in(const SequencePaths& paths) {
  try {
    return image_sizes(list_frames(paths).frames);
  } catch (const Error&) {  // reported when the folder is opened
    return std::nullopt;
  }
}

/// Returns the camera of the frames before rectification: that of the depth images if the color
/// images are larger.
Camera camera_of(const SourceOptions& options, const SequencePaths& paths) {
  const auto sizes = sizes_in(paths);
  const Camera camera = with_ignored(named_camera(options, paths, sizes), options);
  const bool of_color = sizes && cv::Size(camera.width, camera.height) == sizes->color;
  return of_color && sizes->color_is_larger() ? scaled_to(camera, sizes->depth) : camera;
}

FrameRange range_of(const SourceOptions& options) {
  return {.first = options.first, .count = options.count, .stride = options.stride};
}

void check_settings(const SourceOptions& options) {
  if (!(options.fps > 0 && options.fps <= 1000)) {
    throw Error(fmt::format("the frame rate is {}", options.fps), "fps",
                "give frames per second, such as 30");
  }
  if (options.following && !(options.following->patience >= 0)) {
    throw Error(fmt::format("the time to wait for images is {}", options.following->patience),
                "follow", "give seconds, such as 5");
  }
}

/// Throws Error for a file of another kind, and for options that have no effect on the source.
void check_kind(const std::string& text, const std::string& path, const SourceOptions& options) {
  const bool recorded = !names_live_camera(text) && names_recording(text);
  if (!recorded && is_file(path)) {
    throw Error("is no recording that can be read", path,
                "give a .bag, .db3 or .mcap file; videos without depth cannot be mapped, and "
                "docs/cameras.md tells how .svo, .mkv and .r3d files are converted");
  }
  if (recorded && !options.associations.empty()) {
    throw Error("a recorded file has no list of pairs", path,
                "leave --associations out: color and depth are paired by their times");
  }
  if (!recorded && !options.topics.empty())
    throw Error("only recorded files have topics", path, "leave --topics out");
}

void refuse_for_stereo(const SourceOptions& options, const std::string& folder) {
  if (give_camera(options)) {
    throw Error("the folder of a stereo pair contains its cameras", folder,
                "leave --camera out; correct calib.txt or sensor.yaml in the folder");
  }
  if (options.following)
    throw Error("a stereo sequence cannot be followed while it grows", folder,
                "leave --follow out");
}

std::unique_ptr<FrameSource> open_live_camera(const std::string& text,
                                              const SourceOptions& options) {
  if (give_camera(options))
    throw Error("a live camera tells its own calibration", text, "leave --camera out");
  return std::make_unique<LiveSource>(
      open_realsense(text.substr(kRealsense.size()), options.ignore),
      options.following.value_or(Following{}), range_of(options));
}

std::unique_ptr<FrameSource> open_stereo_folder(const std::string& path,
                                                const SourceOptions& options) {
  refuse_for_stereo(options, path);
  StereoSequence sequence = read_stereo_folder(path, options.fps);
  sequence.rig.camera.ignore = options.ignore;
  return std::make_unique<StereoFolder>(std::move(sequence), range_of(options));
}

std::unique_ptr<TumFolder> open_folder(const std::string& path, const SourceOptions& options,
                                       bool growing) {
  SequencePaths paths = find_sequence(path, options.associations);
  const bool lists_tell_times = paths.layout == FolderLayout::kLists && paths.associations.empty();
  if (lists_tell_times && options.fps != SourceOptions{}.fps)
    throw Error("the lists of the folder tell the times of its images", path, "leave --fps out");
  paths.fps = options.fps;
  paths.growing = growing;
  auto folder = std::make_unique<TumFolder>(paths, camera_of(options, paths), range_of(options));
  if (!give_camera(options) && paths.camera.empty()) {
    folder->add_note("camera: " + guessed_camera(paths) + " (by the name or layout of the folder)");
  }
  return folder;
}

}  // namespace

bool names_live_camera(const std::string& text) { return text.starts_with(kRealsense); }

bool names_image_folder(const std::string& text) {
  return !names_live_camera(text) && !names_recording(text) && !is_stereo_folder(folder_of(text));
}

std::unique_ptr<FrameSource> make_source(const std::string& text, const SourceOptions& options) {
  check_settings(options);
  const std::string path = folder_of(text);
  check_kind(text, path, options);
  std::unique_ptr<FrameSource> source;
  MotionSamples samples;
  if (names_live_camera(text)) {
    source = open_live_camera(text, options);
  } else if (names_recording(text)) {
    if (options.following) {
      throw Error("a recorded file cannot be followed while it grows", path,
                  "follow a folder of images, or map the file when it is complete");
    }
    auto recording = std::make_unique<RecordingSource>(
        path, given_camera(path, options), options.topics, range_of(options), options.ignore);
    samples = recording->motion_samples();
    source = std::move(recording);
  } else if (is_stereo_folder(path)) {
    source = open_stereo_folder(path, options);
  } else {
    const auto open = [&](bool growing) { return open_folder(path, options, growing); };
    if (options.following) {
      source = std::make_unique<FollowedFolder>(open, *options.following);
    } else {
      source = open(/*growing=*/false);
    }
  }
  if (samples.empty()) samples = motion_samples_in(path, source->camera());
  std::vector<Finding> findings = motion_findings(samples);
  if (auto unused = unused_motion_files(path, source->camera()))
    findings.push_back(*std::move(unused));
  if (!samples.empty() || !findings.empty())
    source = std::make_unique<InertialSource>(std::move(source), std::move(samples),
                                              std::move(findings));
  if (options.rotate != 0) {
    const Camera camera = rotated(source->camera(), options.rotate);
    source = std::make_unique<ConvertedSource>(
        std::move(source), camera,
        [degrees = options.rotate](const RgbdFrame& frame) { return rotated(frame, degrees); });
  }
  if (options.half_size) {
    const Camera camera = halved(source->camera());
    source = std::make_unique<ConvertedSource>(
        std::move(source), camera, [](const RgbdFrame& frame) { return halved(frame); });
  }
  return source;
}

Camera recorded_camera(const std::string& text, const SourceOptions& options) {
  if (names_live_camera(text)) {
    throw Error("the frames of a live camera cannot be read again", text,
                "keep them first: stillmap record " + text + " FOLDER");
  }
  if (!names_recording(text) && is_stereo_folder(folder_of(text)))
    return read_stereo_folder(folder_of(text), options.fps).rig.camera;
  if (!names_recording(text))
    return camera_of(options, find_sequence(folder_of(text), options.associations));
  if (const auto given = given_camera(folder_of(text), options)) return *given;
  Recording recording(folder_of(text));
  return color_camera(recording, find_rgbd_streams(recording, options.topics));
}

std::filesystem::path true_trajectory_file(const std::string& text) {
  return true_trajectory_in(folder_of(text));
}

}  // namespace stillmap
