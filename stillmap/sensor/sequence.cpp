// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/sequence.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/stamp_unit.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/geometry/association.hpp"
#include "stillmap/recording/name_text.hpp"
#include "stillmap/sensor/fields.hpp"
#include "stillmap/sensor/first_depth.hpp"
#include "stillmap/sensor/frame_times.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/increasing.hpp"
#include "stillmap/sensor/named_time.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLayout =
    "a sequence holds rgb.txt and depth.txt (lines 'timestamp file'), associations.txt (lines "
    "'timestamp rgb_file timestamp depth_file'), folders rgb and depth, or images "
    "frame-000000.color.png and frame-000000.depth.png; docs/cameras.md lists all layouts";

constexpr const char* kReplicaImages = "results";  // folder

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

fs::path first_file(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (is_file(folder / name)) return folder / name;
  }
  return {};
}

/// Returns the first of these folders that exists, or one whose name differs by capitals only.
fs::path first_folder(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (is_folder(folder / name)) return folder / name;
  }
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string found = lower(entry.path().filename().string());
    if (std::find(names.begin(), names.end(), found) != names.end() && is_folder(entry.path()))
      return entry.path();
  }
  return {};
}

/// Returns whether a file has the extension of an image and is not hidden: macOS writes a hidden
/// file beside each file on foreign disks.
bool is_image(const fs::path& file) {
  if (file.filename().string().starts_with('.')) return false;
  const std::string extension = lower(file.extension().string());
  const auto known = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".npy", ".exr"};
  return std::find(known.begin(), known.end(), extension) != known.end();
}

// Beginning and end of image names (without extension), around the number or time.
struct ImageNames {
  std::string begin, end;

  /// Returns the part between them; none if the name does not match.
  std::optional<std::string> between(const std::string& name) const {
    const bool fits =
        name.size() >= begin.size() + end.size() && name.starts_with(begin) && name.ends_with(end);
    if (!fits) return std::nullopt;
    return name.substr(begin.size(), name.size() - begin.size() - end.size());
  }
};

ImageNames names_in(FolderLayout layout, bool is_depth) {
  switch (layout) {
    case FolderLayout::kSevenScenes:
      return {.begin = "", .end = is_depth ? ".depth" : ".color"};
    case FolderLayout::kReplica:
      return {.begin = is_depth ? "depth" : "frame", .end = ""};
    default:
      return {};
  }
}

// Whether a folder holds color images with the names of a layout.
bool has_images_of(FolderLayout layout, const fs::path& folder) {
  std::error_code ignored;
  const auto files = fs::directory_iterator(folder, ignored);
  return std::any_of(begin(files), end(files), [&](const auto& entry) {
    const auto name = names_in(layout, /*is_depth=*/false).between(entry.path().stem().string());
    return is_image(entry.path()) && name && named_time(*name, 1);
  });
}

/// Returns the middle one of the files of a folder, sorted by name; empty without files.
fs::path middle_file(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files.empty() ? fs::path() : files[files.size() / 2];
}

/// Returns the camera file that another program wrote beside the images; empty if there is none.
fs::path camera_of_program(const fs::path& folder) {
  fs::path given =
      first_file(folder, {"camera_matrix.csv", "cam_params.json", "camera_intrinsic.json",
                          "camera_intrinsics.json", "transforms.json", "intrinsic.json",
                          "intrinsic/intrinsic_color.txt", "calibration.txt", "cameras.txt"});
  if (!given.empty()) return given;
  if (is_folder(folder / "calib")) return middle_file(folder / "calib");  // RTAB-Map's export
  if (is_of_record3d(folder)) return folder / kRecord3dFile;
  if (is_folder(folder / "lowres_wide_intrinsics"))
    return middle_file(folder / "lowres_wide_intrinsics");
  return {};
}

void find_image_folders(SequencePaths& paths) {
  const fs::path& folder = paths.folder;
  paths.color_folder = first_folder(
      folder, {"rgb", "color", "image", "images", "rgb_images", "color_images", "lowres_wide"});
  paths.depth_folder = first_folder(
      folder, {"depth", "aligned_depth", "depths", "depth_images", "depth_raw", "lowres_depth"});
  if (!paths.color_folder.empty() && !paths.depth_folder.empty()) {
    paths.layout = FolderLayout::kFolders;
  } else if (has_images_of(FolderLayout::kSevenScenes, folder)) {
    paths.layout = FolderLayout::kSevenScenes;
    paths.color_folder = paths.depth_folder = folder;
  } else if (has_images_of(FolderLayout::kReplica, folder / kReplicaImages)) {
    paths.layout = FolderLayout::kReplica;
    paths.color_folder = paths.depth_folder = folder / kReplicaImages;
    constexpr const char* kCamera = "cam_params.json";  // in the data set, beside all scenes
    if (paths.camera.empty()) paths.camera = first_file(fs::absolute(folder / ".."), {kCamera});
  }
}

SequencePaths look(const fs::path& folder) {
  SequencePaths paths;
  paths.folder = folder;
  paths.color_list = first_file(folder, {"rgb.txt", "color.txt"});
  paths.depth_list = first_file(folder, {"aligned_depth.txt", "depth.txt"});
  paths.associations = first_file(folder, {"associations.txt", "associate.txt", "association.txt"});
  paths.camera = first_file(folder, {"camera.yaml", "camera.yml"});
  if (paths.camera.empty()) paths.camera = camera_of_program(folder);
  paths.ground_truth = true_trajectory_in(folder);
  if (is_folder(folder / "mask")) paths.masks = folder / "mask";
  if (paths.color_list.empty() && paths.depth_list.empty() && paths.associations.empty())
    find_image_folders(paths);
  return paths;
}

bool has_frames(const SequencePaths& paths) {
  if (paths.layout != FolderLayout::kLists) return true;
  return !paths.associations.empty() || (!paths.color_list.empty() && !paths.depth_list.empty());
}

void require_folder(const fs::path& folder) {
  std::error_code refused, ignored;
  if (is_folder(folder)) {
    const fs::directory_iterator first(folder, refused);
    if (refused)
      throw Error("cannot be read: " + refused.message(), folder.string(),
                  "change its permissions");
    return;
  }
  if (!fs::exists(folder, ignored)) {
    throw Error("there is no such folder", folder.string(), "give the folder of a sequence");
  }
  throw Error("is a file, not a folder", folder.string(),
              "unpack or convert it first and give the folder with rgb.txt and depth.txt");
}

// Returns a sequence one level below or above: a frequent mistake after unpacking an archive.
fs::path sequence_nearby(const fs::path& folder) {
  std::error_code ignored;
  std::set<fs::path> below;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (is_folder(entry.path())) below.insert(entry.path());
  }
  for (const auto& candidate : below) {
    if (has_frames(look(candidate))) return candidate;
  }
  const fs::path above = fs::absolute(folder / "..", ignored).lexically_normal();
  return has_frames(look(above)) ? above : fs::path();
}

constexpr const char* kVideo = "rgb.mp4";  // video of the color images of Stray Scanner

Error no_sequence(const SequencePaths& paths) {
  const std::string where = paths.folder.string();
  if (const fs::path nearby = sequence_nearby(paths.folder); !nearby.empty()) {
    return Error("is not a sequence itself", where, "did you mean " + nearby.string() + "?");
  }
  if (is_file(paths.folder / kVideo) && !paths.depth_folder.empty()) {
    return Error(fmt::format("holds its color images as a video, {}, which is not read", kVideo),
                 where,
                 fmt::format("write them to a folder: cd '{}' && mkdir rgb && ffmpeg -noautorotate "
                             "-i {} -fps_mode passthrough -start_number 0 -q:v 2 rgb/%06d.jpg",
                             where, kVideo));
  }
  if (paths.color_list.empty() != paths.depth_list.empty()) {
    const auto [there, missing] = paths.depth_list.empty() ? std::pair("rgb.txt", "depth.txt")
                                                           : std::pair("depth.txt", "rgb.txt");
    return Error(fmt::format("contains {} but no {}", there, missing), where,
                 fmt::format("add {}, one line 'timestamp file' for each image", missing));
  }
  return Error("is not a sequence: neither rgb.txt and depth.txt nor associations.txt is there",
               where, kLayout);
}

// ---- lists
// ---------------------------------------------------------------------------------------

struct Stamp {
  double value = 0;     // seconds
  std::string problem;  // Empty if it is a timestamp.
};

Stamp parse_stamp(const std::string& token) {
  const auto value = number_of(token);
  if (!value) return {0, fmt::format("'{}' is not a timestamp", printable(token))};
  if (!std::isfinite(*value))
    return {0, fmt::format("the timestamp '{}' is not finite", printable(token))};
  return {*value, ""};
}

struct ImageLine {
  double timestamp = 0;  // seconds
  fs::path file;
  std::optional<double> number = {};  // frame number, if the name contains one
};

struct ImageList {
  std::vector<ImageLine> images;
  std::vector<SkippedFrame> skipped;
};

// Calls use(fields) for each line that is neither blank nor a comment; use returns why the line is
// unusable, or an empty text.
std::vector<SkippedFrame> for_each_line(
    const fs::path& list, const std::function<std::string(const std::vector<std::string>&)>& use) {
  std::istringstream in(as_utf8(read_file(list)));
  std::vector<SkippedFrame> skipped;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto fields = fields_of(line);
    if (fields.empty() || fields.front().front() == '#') continue;
    if (number == 1 && lower(fields.front()).starts_with("time")) continue;  // a heading
    const std::string problem = use(fields);
    if (problem.empty()) continue;
    skipped.push_back({0, fmt::format("{}:{}: {}", list.filename().string(), number, problem)});
  }
  return skipped;
}

/// Returns a file named in a list. Lists written on Windows have backslashes. An absolute path may
/// be of another computer: then the file of that name below the folder is used.
fs::path listed_file(const fs::path& folder, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  const fs::path given = name;
  fs::path beside = folder / given;
  const bool of_windows = name.size() > 2 && name[1] == ':' && name[2] == '/';
  if ((!given.is_absolute() && !of_windows) || is_file(beside)) return beside;
  const fs::path below = folder / given.parent_path().filename() / given.filename();
  return is_file(below) ? below : folder / given.filename();
}

/// Joins fields of a line to a file name with blanks, and removes its quotation marks.
std::string joined(const std::vector<std::string>& fields, std::size_t begin, std::size_t end) {
  std::string name;
  for (std::size_t i = begin; i < end; ++i) name += (i > begin ? " " : "") + fields[i];
  if (name.size() > 1 && name.front() == '"' && name.back() == '"')
    name = name.substr(1, name.size() - 2);
  return name;
}

/// Returns the file named after the time in a line; its name may contain blanks if the file exists.
fs::path file_behind_time(const fs::path& folder, const std::vector<std::string>& fields) {
  const fs::path with_blanks = listed_file(folder, joined(fields, 1, fields.size()));
  return fields.size() == 2 || is_file(with_blanks) ? with_blanks
                                                    : listed_file(folder, joined(fields, 1, 2));
}

/// Returns the timestamps of images or frames.
template <typename Stamped>
std::vector<double> stamps_of(const std::vector<Stamped>& all) {
  std::vector<double> stamps;
  stamps.reserve(all.size());
  for (const Stamped& each : all) stamps.push_back(each.timestamp);
  return stamps;
}

/// Converts timestamps in milli-, micro- or nanoseconds to seconds.
void convert_to_seconds(std::vector<ImageLine>& images) {
  const double unit = unit_of_stamps(stamps_of(images));
  for (ImageLine& image : images) image.timestamp *= unit;
}

void convert_to_seconds(std::vector<FrameFiles>& frames) {
  const double unit = unit_of_stamps(stamps_of(frames));
  for (FrameFiles& files : frames) {
    files.timestamp *= unit;
    files.depth_timestamp *= unit;
  }
}

ImageList read_image_list(const fs::path& list) {
  ImageList read;
  read.skipped = for_each_line(list, [&](const std::vector<std::string>& fields) -> std::string {
    const Stamp stamp = parse_stamp(fields[0]);
    if (!stamp.problem.empty()) return stamp.problem;
    if (fields.size() < 2) return "expected 'timestamp file'";
    read.images.push_back({stamp.value, file_behind_time(list.parent_path(), fields), {}});
    return "";
  });
  if (read.images.empty()) {
    throw Error(read.skipped.empty() ? "contains no image" : "contains no line 'timestamp file'",
                list.string(), kLayout);
  }
  convert_to_seconds(read.images);
  return read;
}

/// Returns whether the file listed as color holds a depth image, and the other one a color image:
/// in ICL-NUIM's associations depth comes first.
bool are_exchanged(const fs::path& color, const fs::path& depth) {
  const auto first = read_image_header(color), second = read_image_header(depth);
  return first.problem.empty() && second.problem.empty() && depth_problem(first.header).empty() &&
         color_problem(second.header).empty();
}

// Stamps in seconds are larger than the numbers of frames.
constexpr double kLargestNumber = 1e6;

// Replaces stamps that are numbers of frames by times. Times in seconds are larger, or not whole.
void number_to_time(FrameList& list, double fps) {
  const bool numbers = std::all_of(list.frames.begin(), list.frames.end(), [](const auto& files) {
    return files.timestamp == std::floor(files.timestamp) && files.timestamp < kLargestNumber &&
           files.depth_timestamp == files.timestamp;
  });
  if (!numbers || list.frames.size() < 2) return;
  for (FrameFiles& files : list.frames) files.depth_timestamp = files.timestamp /= fps;
}

/// Moves pairs whose images were not taken at about the same time to the skipped lines.
void skip_distant_pairs(FrameList& list) {
  constexpr double kLargestDifference = 1;  // s; the clocks of two cameras may differ a little
  std::erase_if(list.frames, [&](const FrameFiles& files) {
    const double difference = files.depth_timestamp - files.timestamp;
    if (std::abs(difference) <= kLargestDifference) return false;
    list.skipped.push_back(
        {.timestamp = files.timestamp,
         .reason = fmt::format("{}: its depth image was taken {:.3f} s {}",
                               files.color.filename().string(), std::abs(difference),
                               difference > 0 ? "later" : "earlier")});
    return true;
  });
  if (list.frames.empty()) {
    throw Error("pairs no images of the same time: " + list.skipped.back().reason, "associations",
                "write the times of both images by one clock");
  }
}

/// Returns the columns of a line without the pose that the script of the TUM benchmark writes
/// before or after them if the ground truth was associated, too.
std::vector<std::string> without_pose(const std::vector<std::string>& fields) {
  constexpr std::size_t kPose = 8, kImages = 4;
  if (fields.size() != kPose + kImages) return fields;
  const bool pose_first = number_of(fields[1]).has_value();
  return pose_first ? std::vector(fields.begin() + kPose, fields.end())
                    : std::vector(fields.begin(), fields.begin() + kImages);
}

/// Returns time and name of both images of a line; names may contain blanks if the files exist.
std::vector<std::string> without_blanks(const std::vector<std::string>& fields,
                                        const fs::path& folder) {
  for (std::size_t second = 2; second + 1 < fields.size(); ++second) {
    const std::string color = joined(fields, 1, second),
                      depth = joined(fields, second + 1, fields.size());
    const bool exist = is_file(listed_file(folder, color)) && is_file(listed_file(folder, depth));
    if (number_of(fields[second]) && exist) return {fields[0], color, fields[second], depth};
  }
  return fields;
}

FrameList read_associations(const SequencePaths& paths) {
  const fs::path &list = paths.associations, &folder = paths.folder;
  FrameList read;
  read.skipped = for_each_line(list, [&](const std::vector<std::string>& line) -> std::string {
    const std::vector<std::string> fields = without_blanks(without_pose(line), folder);
    if (fields.size() < 4) return "expected 'timestamp rgb_file timestamp depth_file'";
    const Stamp color = parse_stamp(fields[0]), depth = parse_stamp(fields[2]);
    if (!color.problem.empty()) return color.problem;
    if (!depth.problem.empty()) return depth.problem;
    read.frames.push_back(
        {color.value, depth.value, listed_file(folder, fields[1]), listed_file(folder, fields[3])});
    return "";
  });
  if (read.frames.empty()) {
    throw Error("contains no pair of images", list.string(),
                "write lines 'timestamp rgb_file timestamp depth_file'");
  }
  if (are_exchanged(read.frames.front().color, read.frames.front().depth)) {
    for (FrameFiles& files : read.frames) {
      std::swap(files.color, files.depth);
      std::swap(files.timestamp, files.depth_timestamp);
    }
  }
  convert_to_seconds(read.frames);
  number_to_time(read, paths.fps);
  skip_distant_pairs(read);
  return read;
}

// ---- images without lists

// Returns the error of a folder without images that can be read, which says what it contains.
Error no_image(const fs::path& folder, const std::vector<SkippedFrame>& skipped) {
  if (!skipped.empty())
    return Error("contains no image whose name tells its time or number: " + skipped.front().reason,
                 folder.string(),
                 "name the images by their times in seconds, 1305031229.528.png, by dates, "
                 "20240517_123011.033.png, or by numbers");
  std::map<std::string, int> count;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    ++count[entry.path().extension().string()];
  const auto most = std::max_element(
      count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == count.end()) return Error("contains no image", folder.string(), kLayout);
  return Error(fmt::format("contains no image that can be read: most of its files are '{}'",
                           printable(most->first)),
               folder.string(),
               "convert color images to PNG or JPEG, and depth images to PNG or TIFF");
}

// Returns the images of a folder by time.
ImageList images_of_folder(const fs::path& folder, const ImageNames& names,
                           const FrameTimes& times) {
  ImageList list;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const auto name = names.between(entry.path().stem().string());
    if (!is_image(entry.path()) || !name) continue;
    const auto number = named_number(*name);
    const auto time = number ? times.of(*number) : named_time(*name, times.fps);
    if (time) {
      list.images.push_back({*time, entry.path(), number});
    } else {
      list.skipped.push_back(
          {.timestamp = 0,
           .reason = fmt::format("{}: {}", printable(entry.path().filename().string()),
                                 number ? times.file.filename().string() + " has no time for it"
                                        : "its name is no time or number that can be read")});
    }
  }
  std::sort(list.images.begin(), list.images.end(), [](const auto& a, const auto& b) {
    return std::tie(a.timestamp, a.file) < std::tie(b.timestamp, b.file);
  });
  if (list.images.empty()) throw no_image(folder, list.skipped);
  return list;
}

// Throws Error if the images of both folders are named by numbers that run along each other with an
// offset: by number each color image would get the depth image of another one.
void require_same_numbers(const ImageList& color, const ImageList& depth, const fs::path& folder) {
  const auto number = [](const ImageLine& image) { return std::lround(*image.number); };
  const auto numbered = [](const ImageLine& image) { return image.number.has_value(); };
  const auto &c = color.images, &d = depth.images;
  if (!std::all_of(c.begin(), c.end(), numbered) || !std::all_of(d.begin(), d.end(), numbered))
    return;
  if (c.size() != d.size() || number(c.front()) == number(d.front())) return;
  if (number(c.back()) - number(c.front()) != number(d.back()) - number(d.front())) return;
  throw Error(
      fmt::format("has {} color images that are numbered {} to {}, and as many depth images "
                  "that are numbered {} to {}",
                  c.size(), number(c.front()), number(c.back()), number(d.front()),
                  number(d.back())),
      folder.string(), "number the images of one frame alike, or give --associations FILE");
}

Error no_pair(const ImageList& color, const ImageList& depth, const fs::path& folder) {
  const auto span = [](const ImageList& list) {
    return fmt::format("{:.3f} to {:.3f} s", list.images.front().timestamp,
                       list.images.back().timestamp);
  };
  return Error(
      fmt::format("no color image has a depth image within {} s: color images run from {}, "
                  "depth images from {}",
                  kMaxPairDifference, span(color), span(depth)),
      folder.string(),
      "check that both are of one recording, with times in seconds, or give an associations file");
}

// Returns the color or depth images of the lists, or of folders without lists.
ImageList images_of(const SequencePaths& paths, bool is_depth) {
  const fs::path& folder = is_depth ? paths.depth_folder : paths.color_folder;
  const fs::path& list = is_depth ? paths.depth_list : paths.color_list;
  const bool has_list = paths.layout == FolderLayout::kLists;
  ImageList images =
      has_list ? read_image_list(list)
               : images_of_folder(folder, names_in(paths.layout, is_depth), frame_times(paths));
  keep_increasing(images.images, images.skipped, (has_list ? list : folder).filename().string());
  return images;
}

FrameList pair_lists(const SequencePaths& paths) {
  ImageList color = images_of(paths, false), depth = images_of(paths, true);
  if (are_exchanged(color.images.front().file, depth.images.front().file)) std::swap(color, depth);
  if (paths.layout != FolderLayout::kLists && !paths.growing)
    require_same_numbers(color, depth, paths.folder);
  const auto pairs =
      associate(stamps_of(color.images), stamps_of(depth.images), kMaxPairDifference);
  if (pairs.empty()) throw no_pair(color, depth, paths.folder);

  FrameList list;
  list.skipped = std::move(color.skipped);
  for (SkippedFrame& line : depth.skipped) {
    line.frame_lost = false;
    list.skipped.push_back(std::move(line));
  }
  for (const ImageLine& c : color.images)
    list.frames.push_back({c.timestamp, c.timestamp, c.file, {}});
  for (const auto& [i, j] : pairs) {
    list.frames[i].depth_timestamp = depth.images[j].timestamp;
    list.frames[i].depth = depth.images[j].file;
  }
  skip_before_first_depth(
      list.frames, [](const FrameFiles& files) { return !files.depth.empty(); },
      [](const FrameFiles& files) { return files.color.filename().string(); }, list.skipped);
  if (paths.growing) {
    const double newest_depth = depth.images.back().timestamp;
    std::erase_if(list.frames, [&](const FrameFiles& files) {
      return files.timestamp > newest_depth - kMaxPairDifference;
    });
  }
  return list;
}

// ---- folders that still grow

// Images are written in the order of time, so only the newest can be incomplete.
void hold_back_incomplete(std::vector<FrameFiles>& frames) {
  const auto complete = [](const FrameFiles& files) {
    return read_image_header(files.color).problem.empty() &&
           (files.depth.empty() || read_image_header(files.depth).problem.empty());
  };
  while (!frames.empty() && !complete(frames.back())) frames.pop_back();
}

}  // namespace

fs::path true_trajectory_in(const fs::path& folder) {
  const fs::path truth = first_file(folder, {"groundtruth.txt", "lowres_wide.traj"});
  const bool of_replica = is_folder(folder / kReplicaImages);
  return truth.empty() && of_replica ? first_file(folder, {"traj.txt"}) : truth;
}

SequencePaths find_sequence(const fs::path& folder, const fs::path& associations) {
  require_folder(folder);
  SequencePaths paths = look(folder);
  if (!associations.empty()) {
    if (!is_file(associations)) {
      throw Error("is not a file", associations.string(),
                  "give a file with lines 'timestamp rgb_file timestamp depth_file'");
    }
    paths.associations = associations;
    return paths;
  }
  if (!has_frames(paths)) throw no_sequence(paths);
  if (!paths.color_list.empty() && !paths.depth_list.empty()) paths.associations.clear();
  return paths;
}

FrameList list_frames(const SequencePaths& paths) {
  FrameList list;
  if (paths.associations.empty()) {
    list = pair_lists(paths);
  } else {
    list = read_associations(paths);
    keep_increasing(list.frames, list.skipped, paths.associations.filename().string());
  }
  if (paths.growing) hold_back_incomplete(list.frames);
  std::stable_sort(list.skipped.begin(), list.skipped.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return list;
}

}  // namespace stillmap
