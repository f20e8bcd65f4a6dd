// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/stereo_folder.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/recording/recording.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/increasing.hpp"
#include "stillmap/sensor/rectified_frame.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

std::string name_of(const fs::path& file) {
  return file.parent_path().filename().string() + "/" + file.filename().string();
}

// ---- KITTI

constexpr const char* kKittiFix =
    "give the calib.txt of the KITTI odometry benchmark: lines 'P0:' to 'P3:' with 12 numbers";

// Folders of a KITTI sequence: left, right, and their lines in calib.txt.
struct KittiFolders {
  const char *left, *right, *left_line, *right_line;
};
constexpr std::array<KittiFolders, 3> kKittiFolders{{{"image_2", "image_3", "P2", "P3"},
                                                     {"image_0", "image_1", "P0", "P1"},
                                                     {"image_l", "image_r", "P0", "P1"}}};

const KittiFolders* kitti_folders(const fs::path& folder) {
  const auto found =
      std::find_if(kKittiFolders.begin(), kKittiFolders.end(), [&](const KittiFolders& pair) {
        return is_folder(folder / pair.left) && is_folder(folder / pair.right);
      });
  return found == kKittiFolders.end() ? nullptr : &*found;
}

using Projection = std::array<double, 12>;  // 3 x 4, by rows [pixels, pixels * m]

// Returns the projections of a calib.txt by their names; lines without names are P0, P1, ...
std::map<std::string, Projection> read_projections(const fs::path& file) {
  std::istringstream in(read_file(file));
  std::map<std::string, Projection> projections;
  for (std::string line; std::getline(in, line);) {
    std::istringstream fields(line);
    std::string name = fmt::format("P{}", projections.size());
    if (const auto colon = line.find(':'); colon != std::string::npos) {
      name = line.substr(0, colon);
      fields.str(line.substr(colon + 1));
    }
    Projection projection{};
    std::size_t count = 0;
    for (std::string word; count < projection.size() && fields >> word;) {
      const auto value = number_of(word);
      if (!value) break;
      projection.at(count++) = *value;
    }
    if (count == projection.size()) projections[name] = projection;
  }
  return projections;
}

const Projection& projection_of(const std::map<std::string, Projection>& projections,
                                const std::string& name, const fs::path& file) {
  const auto found = projections.find(name);
  if (found == projections.end())
    throw Error(fmt::format("has no line '{}' with 12 numbers", name), file.string(), kKittiFix);
  const Projection& p = found->second;
  const bool finite = std::all_of(p.begin(), p.end(), [](double x) { return std::isfinite(x); });
  if (!finite || p[0] <= 0)
    throw Error(fmt::format("the line '{}' is no projection", name), file.string(), kKittiFix);
  return p;
}

cv::Size size_of_first(const std::vector<fs::path>& images) {
  for (const fs::path& image : images) {
    const HeaderRead read = read_image_header(image);
    if (read.problem.empty()) return read.header.size;
  }
  throw Error("contains no readable image", images.front().parent_path().string(),
              "give 8-bit PNG or JPEG images");
}

StereoRig kitti_rig(const fs::path& file, const KittiFolders& names, cv::Size size) {
  if (!fs::exists(file)) throw Error("is missing", file.string(), kKittiFix);
  const auto projections = read_projections(file);
  const Projection& left = projection_of(projections, names.left_line, file);
  const Projection& right = projection_of(projections, names.right_line, file);
  for (const int i : {0, 2, 5, 6}) {
    const auto at = static_cast<std::size_t>(i);
    if (std::abs(left.at(at) - right.at(at)) > 1e-3)
      throw Error("the two projections have different intrinsics", file.string(), kKittiFix);
  }
  Camera camera;
  camera.name = "kitti";
  camera.width = size.width, camera.height = size.height;
  camera.fx = left[0], camera.fy = left[5], camera.cx = left[2], camera.cy = left[6];
  return rectified_rig(camera, (left[3] - right[3]) / left[0], file.string());
}

// Returns the images of a folder in the order of their names.
std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> images;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const auto extension = entry.path().extension();
    if (entry.path().filename().string().starts_with('.')) continue;  // hidden file of macOS
    if (extension == ".png" || extension == ".jpg") images.push_back(entry.path());
  }
  std::sort(images.begin(), images.end());
  if (images.empty()) throw Error("contains no image", folder.string(), "give PNG or JPEG images");
  return images;
}

std::vector<double> read_times(const fs::path& file) {
  std::istringstream in(read_file(file));
  std::vector<double> times;
  for (std::string word; in >> word;) {
    const auto time = number_of(word);
    if (!time) break;
    times.push_back(*time);
  }
  return times;
}

// Returns the times of the frames [s], of times.txt or by the rate.
std::vector<double> kitti_times(const fs::path& folder, std::size_t count, double fps) {
  const fs::path file = folder / "times.txt";
  std::vector<double> times;
  if (is_file(file)) {
    times = read_times(file);
    if (times.size() < count) {
      throw Error("has " + counted(times.size(), "time") + " for " + counted(count, "image"),
                  file.string(), "give one time in seconds a line for each image");
    }
    return times;
  }
  for (std::size_t i = 0; i < count; ++i) times.push_back(static_cast<double>(i) / fps);
  return times;
}

StereoSequence read_kitti(const fs::path& folder, const KittiFolders& names, double fps) {
  StereoSequence sequence;
  const auto images = images_in(folder / names.left);
  sequence.layout = fmt::format("KITTI, {} and {}", names.left, names.right);
  sequence.rig = kitti_rig(folder / "calib.txt", names, size_of_first(images));
  const auto times = kitti_times(folder, images.size(), fps);
  for (std::size_t i = 0; i < images.size(); ++i)
    sequence.frames.push_back({times[i], images[i], folder / names.right / images[i].filename()});
  return sequence;
}

// ---- EuRoC

fs::path euroc_root(const fs::path& folder) {
  for (const fs::path& root : {folder / "mav0", folder}) {
    if (is_folder(root / "cam0" / "data") && is_folder(root / "cam1" / "data")) return root;
  }
  return {};
}

// Returns the numbers of a key of a sensor.yaml.
std::vector<double> numbers_of(const YAML::Node& node, std::size_t count, const char* key,
                               const fs::path& file) {
  std::vector<double> values;
  if (node.IsSequence()) {
    for (const auto& item : node) values.push_back(item.as<double>(NAN));
  }
  const bool finite =
      std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  if (!finite || values.size() < count) {
    throw Error(fmt::format("expected {} numbers", count),
                fmt::format("{}, key '{}'", file.string(), key), "give EuRoC's sensor.yaml");
  }
  return values;
}

Pose pose_in(const std::vector<double>& m) {
  Eigen::Matrix3d R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  return {R, {m[3], m[7], m[11]}};
}

LensDistortion lens_in(const YAML::Node& yaml, const fs::path& file) {
  const auto model = yaml["distortion_model"].as<std::string>("radial-tangential");
  LensDistortion lens{.coefficients = numbers_of(yaml["distortion_coefficients"], 4,
                                                 "distortion_coefficients", file)};
  if (model == "equidistant") {
    lens.model = LensDistortion::Model::kFisheye;
  } else if (model != "radial-tangential") {
    throw Error(fmt::format("the distortion model '{}' is not supported", model), file.string(),
                "rectify the images first");
  }
  return lens;
}

struct EurocCamera {
  StereoCamera camera;
  double fps = 0;  // Hz
};

EurocCamera read_euroc_camera(const fs::path& file) {
  std::string text = read_file(file);
  if (text.starts_with('%')) text[0] = '#';  // OpenCV's "%YAML:1.0" is no YAML.
  YAML::Node yaml;
  try {
    yaml = YAML::Load(text);
    const auto f = numbers_of(yaml["intrinsics"], 4, "intrinsics", file);
    const auto size = numbers_of(yaml["resolution"], 2, "resolution", file);
    EurocCamera read;
    read.camera.recorded = {.width = static_cast<int>(size[0]),
                            .height = static_cast<int>(size[1]),
                            .fx = f[0],
                            .fy = f[1],
                            .cx = f[2],
                            .cy = f[3],
                            .lens = lens_in(yaml, file)};
    read.camera.T_rig_camera = pose_in(numbers_of(yaml["T_BS"]["data"], 16, "T_BS", file));
    read.fps = yaml["rate_hz"].as<double>(20);
    return read;
  } catch (const YAML::Exception& error) {
    throw Error("is not YAML: " + error.msg, file.string(), "give EuRoC's sensor.yaml");
  }
}

// Returns the images of a camera by their times [ns].
std::map<std::int64_t, fs::path> read_euroc_images(const fs::path& camera) {
  std::istringstream in(read_file(camera / "data.csv"));
  std::map<std::int64_t, fs::path> images;
  for (std::string line; std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::int64_t time = 0;
    std::string file;
    if (fields >> time >> file) images[time] = camera / "data" / file;
  }
  if (images.empty()) {
    throw Error("contains no image", (camera / "data.csv").string(),
                "give lines 'timestamp,file' with nanoseconds");
  }
  return images;
}

StereoSequence read_euroc(const fs::path& root) {
  StereoSequence sequence;
  sequence.layout = "EuRoC, cam0 and cam1";
  const EurocCamera left = read_euroc_camera(root / "cam0" / "sensor.yaml");
  const EurocCamera right = read_euroc_camera(root / "cam1" / "sensor.yaml");
  sequence.rig = calibrated_rig(left.camera, right.camera, left.fps, root.string());
  sequence.rig.camera.name = "euroc";
  const auto right_images = read_euroc_images(root / "cam1");
  for (const auto& [time, image] : read_euroc_images(root / "cam0")) {
    const auto match = right_images.find(time);
    sequence.frames.push_back(
        {seconds_of(time), image, match == right_images.end() ? fs::path() : match->second});
  }
  return sequence;
}

double median_rate(const std::vector<StereoFiles>& frames, double otherwise) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < frames.size(); ++i)
    intervals.push_back(frames[i].timestamp - frames[i - 1].timestamp);
  if (intervals.empty()) return otherwise;
  return 1 / std::clamp(upper_median(intervals), 1e-3, 10.0);
}

}  // namespace

bool is_stereo_folder(const fs::path& folder) {
  return kitti_folders(folder) != nullptr || !euroc_root(folder).empty();
}

StereoSequence read_stereo_folder(const fs::path& folder, double fps) {
  const KittiFolders* kitti = kitti_folders(folder);
  StereoSequence sequence =
      kitti != nullptr ? read_kitti(folder, *kitti, fps) : read_euroc(euroc_root(folder));
  keep_increasing(sequence.frames, sequence.skipped, "times");
  sequence.rig.camera.fps = median_rate(sequence.frames, fps);
  return sequence;
}

StereoFolder::StereoFolder(StereoSequence sequence, const FrameRange& range)
    : sequence_(std::move(sequence)), rectifier_(sequence_.rig), matcher_(camera()) {
  check_range(range);
  keep_range(range, sequence_.layout, sequence_.frames, sequence_.skipped);
}

std::vector<std::string> StereoFolder::notes() const {
  std::vector<std::string> notes{
      fmt::format("stereo: {}, {}", sequence_.layout, description(sequence_.rig))};
  if (!rectifier_.ignored_note().empty()) notes.push_back(rectifier_.ignored_note());
  return notes;
}

void StereoFolder::skip_before(double timestamp) {
  const std::size_t count = count_before(timestamp, sequence_.frames, position_);
  position_ += count;
  next_index_ += count;
}

RgbdFramePtr StereoFolder::next() {
  while (position_ < sequence_.frames.size()) {
    if (RgbdFramePtr frame = load(sequence_.frames[position_++])) return frame;
  }
  return nullptr;
}

RgbdFramePtr StereoFolder::load(const StereoFiles& files) {
  trace_frame(next_index_);
  const TraceScope scope("read frame");
  const ImageRead left = read_color_image(files.left, {camera().width, camera().height});
  if (!left.problem.empty()) {
    sequence_.skipped.push_back({files.timestamp, name_of(files.left) + " " + left.problem});
    return nullptr;
  }
  const cv::Mat color = rectified(sequence_.rig, 0, left.image);
  auto frame = rectified_frame(rectifier_, color, load_depth(files, color), files.timestamp, 0);
  frame->index = next_index_++;
  return frame;
}

/// Returns the depth of a frame, 32FC1 [m]; an empty image if the right one cannot be used.
cv::Mat StereoFolder::load_depth(const StereoFiles& files, const cv::Mat& left) {
  const ImageRead right = files.right.empty()
                              ? ImageRead{{}, "has no right image"}
                              : read_color_image(files.right, {camera().width, camera().height});
  if (!right.problem.empty()) {
    const fs::path& file = files.right.empty() ? files.left : files.right;
    sequence_.skipped.push_back({.timestamp = files.timestamp,
                                 .reason = name_of(file) + " " + right.problem,
                                 .frame_lost = false});
    return {};
  }
  return depth_of_pair(sequence_.rig, matcher_, left, right.image);
}

}  // namespace stillmap
