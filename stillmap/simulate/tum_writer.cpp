// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/tum_writer.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/motion_files.hpp"
#include "stillmap/simulate/seen_surface.hpp"

#include <regex>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// File with the static objects; only simulated sequences have one.
constexpr const char* kMarker = "things.csv";

cv::Mat raw_depth(const cv::Mat& meters, double factor) {
  cv::Mat raw;
  meters.convertTo(raw, CV_16UC1, factor);  // rounds and saturates
  return raw;
}

/// Gray levels of 5 mm/s, as read by `evaluate`.
cv::Mat speed_levels(const cv::Mat& meters_per_second) {
  cv::Mat levels;
  meters_per_second.convertTo(levels, CV_8UC1, 1 / 0.005);  // rounds and saturates
  return levels;
}

std::string mover_lines(const TruthFrame& truth) {
  std::string lines;
  for (const MoverTruth& m : truth.movers) {
    const auto triple = [](const Eigen::Vector3d& v) {
      return fmt::format("{:.5f},{:.5f},{:.5f}", v.x(), v.y(), v.z());
    };
    lines += fmt::format("{},{:.6f},{},{},{},{},{},{},{},{},{:.3f},{:.3f}\n", truth.index,
                         truth.timestamp, m.id, m.class_name, m.name, triple(m.centroid),
                         triple(m.velocity), triple(m.box.min()), triple(m.box.max()), m.pixels,
                         m.in_view, m.shown);
  }
  return lines;
}

/// The corners of a box; empty fields for an empty one.
std::string box_fields(const Eigen::AlignedBox3f& box) {
  if (box.isEmpty()) return ",,,,,";
  const Eigen::Vector3f &a = box.min(), &b = box.max();
  return fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}", a.x(), a.y(), a.z(), b.x(), b.y(),
                     b.z());
}

std::string object_lines(const std::vector<simulate::NamedObject>& objects) {
  std::string lines = "class,min_x,min_y,min_z,max_x,max_y,max_z\n";
  for (const simulate::NamedObject& object : objects)
    lines += fmt::format("{},{}\n", object.class_name, box_fields(object.box));
  return lines;
}

/// Text files with one line per frame.
struct Lists {
  std::string rgb = "# color images\n# timestamp filename\n";
  std::string depth = "# depth images\n# timestamp filename\n";
  std::string associations;
  std::string movers =
      "frame,timestamp,id,class,name,x,y,z,vx,vy,vz,min_x,min_y,min_z,max_x,max_y,max_z,pixels,"
      "in_view,shown\n";

  void add(const std::string& stamp, const TruthFrame& truth) {
    rgb += fmt::format("{0} rgb/{0}.png\n", stamp);
    depth += fmt::format("{0} depth/{0}.png\n", stamp);
    associations += fmt::format("{0} rgb/{0}.png {0} depth/{0}.png\n", stamp);
    movers += mover_lines(truth);
  }

  void write(const std::filesystem::path& folder) const {
    write_file(folder / "rgb.txt", rgb);
    write_file(folder / "depth.txt", depth);
    write_file(folder / "associations.txt", associations);
    write_file(folder / "truth_movers.csv", movers);
  }
};

std::string rearranged_lines(const std::vector<Rearrangement>& pieces) {
  std::string lines = "name";
  for (const char* visit : {"first", "second"}) {
    for (const char* corner : {"min", "max"})
      for (const char axis : {'x', 'y', 'z'})
        lines += fmt::format(",{}_{}_{}", visit, corner, axis);
  }
  lines += "\n";
  for (const Rearrangement& piece : pieces)
    lines +=
        fmt::format("{},{},{}\n", piece.name, box_fields(piece.first), box_fields(piece.second));
  return lines;
}

std::string tag_lines(const std::vector<PlacedTag>& tags) {
  std::string lines = "id";
  for (int i = 0; i < 4; ++i) lines += fmt::format(",x{0},y{0},z{0}", i);
  lines += "\n";
  for (const PlacedTag& tag : tags) {
    lines += fmt::format("{}", tag.id);
    for (const Eigen::Vector3d& p : tag.corners)
      lines += fmt::format(",{:.6f},{:.6f},{:.6f}", p.x(), p.y(), p.z());
    lines += "\n";
  }
  return lines;
}

/// Removes the images of a sequence, TIMESTAMP.png, and no other file.
void remove_images(const std::filesystem::path& folder) {
  const std::regex name(R"(\d+\.\d{6}\.png)");
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (std::regex_match(entry.path().filename().string(), name))
      std::filesystem::remove(entry.path());
}

/// Makes the folder of a sequence, without the files of an earlier one. Throws Error for a folder
/// with other files: things.csv marks the folders of simulated sequences.
void make_sequence_folder(const std::filesystem::path& folder) {
  make_output_folder(folder);
  const bool is_simulated = std::filesystem::exists(folder / kMarker);
  if (!is_simulated && !std::filesystem::is_empty(folder)) {
    throw Error("is not empty, and not the folder of a simulated sequence", folder.string(),
                "name a new or an empty folder");
  }
  write_file(folder / kMarker, "");
  for (const char* list : {"rgb.txt", "depth.txt", "associations.txt"})
    std::filesystem::remove(folder / list);
  std::filesystem::remove(folder / "imu0" / "data.csv");
  std::filesystem::remove(folder / "odometry.txt");
  std::filesystem::remove(folder / "rearranged.csv");
  std::filesystem::remove(folder / "tags.csv");
  for (const char* name : {"rgb", "depth", "mask", "instance", "speed"}) {
    make_output_folder(folder / name);
    remove_images(folder / name);
  }
}

}  // namespace

std::size_t write_tum_layout(const SimulatedSequence& sequence, const std::filesystem::path& folder,
                             const std::function<bool(std::size_t)>& done) {
  make_sequence_folder(folder);
  Lists lists;
  SeenSurface surface(sequence.camera());
  std::size_t frames = 0;
  for (bool goes_on = true; goes_on && frames < sequence.frames();) {
    const SimulatedFrame made = sequence.at(frames);
    const std::string stamp = fmt::format("{:.6f}", made.truth.timestamp), file = stamp + ".png";
    write_png(folder / "rgb" / file, made.frame->color);
    write_png(folder / "depth" / file,
              raw_depth(made.frame->depth, sequence.camera().depth_factor));
    write_png(folder / "mask" / file, class_mask(made.truth));
    write_png(folder / "instance" / file, made.truth.instances);
    write_png(folder / "speed" / file, speed_levels(sequence.speed(frames)));
    lists.add(stamp, made.truth);
    surface.add(made.truth);
    ++frames;
    if (done) goes_on = done(frames);
  }
  write_camera(folder / "camera.yaml", sequence.camera());
  if (!sequence.imu_samples().empty()) {
    make_output_folder(folder / "imu0");
    write_imu(folder / "imu0" / "data.csv", sequence.imu_samples());
  }
  if (!sequence.odometry().empty()) write_odometry(folder / "odometry.txt", sequence.odometry());
  Trajectory trajectory = sequence.trajectory();
  trajectory.resize(frames);
  write_trajectory(folder / "groundtruth.txt", trajectory);
  write_file(folder / "surface.ply", points_ply(surface.points()));
  write_file(folder / kMarker, object_lines(sequence.scene().statics.things));
  if (const auto& pieces = sequence.scene().rearranged; !pieces.empty())
    write_file(folder / "rearranged.csv", rearranged_lines(pieces));
  if (const auto& tags = sequence.scene().tags; !tags.empty())
    write_file(folder / "tags.csv", tag_lines(tags));
  lists.write(folder);
  return frames;
}

}  // namespace stillmap
