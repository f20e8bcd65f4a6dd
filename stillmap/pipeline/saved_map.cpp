// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/saved_map.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/field_text.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/journal_file.hpp"
#include "stillmap/base/parallel_for.hpp"
#include "stillmap/map/camera_change.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/map/map_records.hpp"
#include "stillmap/map/pose_bytes.hpp"
#include "stillmap/pipeline/recovered_run.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <sstream>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::array<char, 4> kInfo = {'I', 'N', 'F', 'O'};
constexpr std::array<char, 4> kVisits = {'V', 'I', 'S', 'T'};
constexpr std::array<char, 4> kDense = {'D', 'E', 'N', 'S'};
/// Size of the views of a section, unless it holds a single larger one [bytes].
constexpr std::size_t kDenseSection = 16U << 20;

using Bgr = std::array<std::uint8_t, 3>;  // as cv::Vec3b lies in memory

/// Returns the pixels of an image of a view, which is stored continuously.
template <typename Pixel>
std::span<const Pixel> pixels_of(const cv::Mat& image) {
  return {reinterpret_cast<const Pixel*>(image.data), image.total()};
}

template <typename Pixel>
cv::Mat get_image(ByteReader& in, cv::Size size, int type) {
  const auto pixels = in.get_planes<Pixel>(static_cast<std::size_t>(size.area()));
  cv::Mat image(size, type);
  if (!pixels.empty()) std::memcpy(image.data, pixels.data(), pixels.size() * sizeof(Pixel));
  return image;
}

/// Reads the lattice of a view. The map's other values of the camera apply to all views.
DenseView get_lattice(ByteReader& in, const Camera& camera) {
  DenseView view;
  view.camera = camera;
  for (int* number : {&view.stride, &view.camera.width, &view.camera.height}) {
    *number = in.get<std::int32_t>();
  }
  for (double* x : {&view.camera.fx, &view.camera.fy, &view.camera.cx, &view.camera.cy}) {
    *x = in.get<double>();
    if (!std::isfinite(*x)) in.fail("the camera of a view has a value that is not finite");
  }
  const auto is_side = [](int pixels) { return pixels >= 0 && pixels <= kMaxSide; };
  if (view.stride < 1 || !is_side(view.camera.width) || !is_side(view.camera.height) ||
      view.camera.fx <= 0 || view.camera.fy <= 0) {
    in.fail("the camera of a view is out of range");
  }
  return view;
}

/// Returns the ends of the views of each section, at least one.
std::vector<std::size_t> ends_of_sections(const std::vector<AnchoredView>& views) {
  std::vector<std::size_t> ends;
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::size_t next = views[i].view.bytes();
    if (bytes > 0 && bytes + next > kDenseSection) {
      ends.push_back(i);
      bytes = 0;
    }
    bytes += next;
  }
  ends.push_back(views.size());
  return ends;
}

std::string visits_bytes(const std::vector<AnchoredView>& views) {
  ByteWriter out;
  for (const AnchoredView& v : views) out.put(v.view.visit);
  return out.take();
}

std::string dense_bytes(std::span<const AnchoredView> views) {
  ByteWriter out;
  out.put(static_cast<std::uint32_t>(views.size()));
  for (const AnchoredView& v : views) {
    out.put(v.anchor.slot);
    put_pose(out, v.T_anchor_camera);
    put_view(out, v.view);
  }
  return out.take();
}

void write_map(std::ostream& out, const SavedMap& saved) {
  std::vector<Section> sections = map_sections(saved.map);
  const std::vector<std::size_t> ends = ends_of_sections(saved.views);
  SectionWriter file(kMapFormat, out, 2 + sections.size() + ends.size());
  ByteWriter info;
  info.put_text(saved.writer);
  file.add({kInfo, info.bytes()});
  file.add(sections);
  sections.clear();
  file.add({kVisits, visits_bytes(saved.views)});
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    sections.push_back({kDense, dense_bytes(std::span(saved.views).subspan(begin, end - begin))});
    begin = end;
    if (static_cast<int>(sections.size()) < all_threads() && end != ends.back()) continue;
    file.add(sections);
    sections.clear();
  }
  file.finish();
}

/// Sets the visits of the views; maps of former programs have none.
void read_visits(const std::vector<Section>& sections, const std::string& where,
                 std::vector<AnchoredView>& views) {
  for (AnchoredView& view : views) view.view.visit = 0;
  if (std::ranges::find(sections, kVisits, &Section::name) == sections.end()) return;
  ByteReader in = section_reader(sections, "VIST", where);
  for (AnchoredView& view : views) view.view.visit = in.get<std::uint16_t>();
  in.expect_end();
}

/// Adds the views of a section.
void add_views(ByteReader in, ViewReader& memory, SavedMap& saved) {
  const auto count = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    AnchoredView v;
    v.anchor = {in.get<std::uint32_t>(), 0};
    if (v.anchor.slot >= saved.map.keyframes.size()) in.fail("a view belongs to no keyframe");
    v.T_anchor_camera = get_pose(in);
    v.view = memory.read(in, saved.map.camera);
    saved.views.push_back(std::move(v));
  }
  in.expect_end();
}

/// Reads the sections of the map, then those of the views, which come last.
SavedMap read_map(std::istream& in, const std::string& where, const MemoryLimit& memory) {
  SectionReader file(kMapFormat, in, where);
  SavedMap saved;
  saved.version = file.version();
  std::vector<Section> sections;
  std::optional<Section> next = file.next();
  for (; next && next->name != kDense; next = file.next()) sections.push_back(std::move(*next));
  ByteReader info = section_reader(sections, "INFO", where);
  saved.writer = info.get_text();
  info.expect_end();
  saved.map = map_from_sections(sections, where);
  ViewReader views(memory, saved.version);
  if (!next) section_reader({}, "DENS", where);  // throws
  for (; next; next = file.next()) {
    const std::vector<Section> dense = {std::move(*next)};
    add_views(section_reader(dense, "DENS", where), views, saved);
  }
  read_visits(sections, where, saved.views);
  return saved;
}

}  // namespace

std::uint16_t end_of_visits(const std::vector<AnchoredView>& views) {
  std::uint16_t end = 0;
  for (const AnchoredView& view : views) {
    if (view.view.visit == DenseView::kPresentVisit) continue;
    end = std::max(end, static_cast<std::uint16_t>(view.view.visit + 1));
  }
  return end;
}

void number_present_visit(std::vector<AnchoredView>& views) {
  const std::uint16_t present = end_of_visits(views);
  for (AnchoredView& view : views)
    if (view.view.visit == DenseView::kPresentVisit) view.view.visit = present;
}

void put_view(ByteWriter& out, const DenseView& view) {
  for (const int number : {view.stride, view.camera.width, view.camera.height}) {
    out.put<std::int32_t>(number);
  }
  for (const double x : {view.camera.fx, view.camera.fy, view.camera.cx, view.camera.cy})
    out.put(x);
  for (const int side : {view.depth.cols, view.depth.rows}) out.put<std::int32_t>(side);
  out.put_planes(pixels_of<std::uint16_t>(view.depth));
  out.put_planes(pixels_of<Bgr>(view.color));
  out.put_planes(pixels_of<std::uint8_t>(view.kind));
  out.put(static_cast<std::uint32_t>(view.instances.size()));
  for (const ViewInstance& instance : view.instances) {
    out.put_text(instance.class_name);
    out.put(instance.confidence);
  }
  out.put(static_cast<std::uint32_t>(view.photo.total()));
  out.put_list(pixels_of<std::uint8_t>(view.photo));
  view.drop_pages();
}

DenseView get_view(ByteReader& in, const Camera& camera, std::uint32_t version) {
  DenseView view = get_lattice(in, camera);
  const auto cols = in.get<std::int32_t>(), rows = in.get<std::int32_t>();
  const bool whole = cols == view.camera.width && rows == view.camera.height;
  if (!whole && (cols != 0 || rows != 0)) in.fail("a view has another size than its camera");
  view.depth = get_image<std::uint16_t>(in, {cols, rows}, CV_16UC1);
  view.color = get_image<Bgr>(in, {cols, rows}, CV_8UC3);
  view.kind = get_image<std::uint8_t>(in, {cols, rows}, CV_8UC1);
  const auto instances = in.get<std::uint32_t>();
  for (std::uint32_t i = 0; i < instances; ++i) {
    std::string name = field_text(in.get_text());
    view.instances.push_back({std::move(name), in.get<float>()});
    if (!std::isfinite(view.instances.back().confidence)) in.fail("a confidence is not finite");
  }
  for (const std::uint8_t kind : view.kind) {
    const bool instance = kind >= kFirstInstance && kind < kFarSurface;
    if (instance && kind - kFirstInstance >= static_cast<int>(instances))
      in.fail("a pixel belongs to no instance");
  }
  if (version >= kPhotoVersion) {
    const auto photo = in.get_list<std::uint8_t>(in.get<std::uint32_t>());
    if (!photo.empty()) view.photo = cv::Mat1b(photo, true).reshape(0, 1);
  }
  return view;
}

DenseView ViewReader::read(ByteReader& in, const Camera& camera) {
  DenseView view = get_view(in, camera, version_);
  if (in_memory_ + view.bytes_in_memory() > pager_.limit()) pager_.page_out(view);
  in_memory_ += view.bytes_in_memory();
  return view;
}

std::string saved_map_bytes(const SavedMap& saved) {
  std::ostringstream out;
  write_map(out, saved);
  return out.str();
}

SavedMap saved_map_from_bytes(std::string_view bytes, const std::string& where,
                              const MemoryLimit& memory) {
  std::istringstream in{std::string(bytes)};
  return read_map(in, where, memory);
}

void write_saved_map(const std::filesystem::path& file, const SavedMap& saved) {
  write_file(file, [&](std::ostream& out) { write_map(out, saved); });
}

bool is_saved_map(const std::filesystem::path& file) {
  std::string start(kMapFormat.magic.size(), ' ');
  std::ifstream(file, std::ios::binary)
      .read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == kMapFormat.magic;
}

std::filesystem::path map_file_of(const std::filesystem::path& source) {
  if (!std::filesystem::is_directory(source)) return source;
  for (const char* name : {kRunJournal, kRunMap}) {
    if (std::filesystem::exists(source / name)) return source / name;
  }
  throw Error("contains no map (run.map)", source.string(),
              "name the result folder of a run, or a map that was saved with --save-map");
}

SavedMap read_saved_map(const std::filesystem::path& source, const MemoryLimit& memory) {
  const std::filesystem::path file = map_file_of(source);
  if (is_journal(file)) return recovered_run(file, memory).map;
  std::ifstream in = open_file(file);
  return read_map(in, file.string(), memory);
}

MapContent map_for(MapContent map, const Camera& camera, const PyramidShape& pyramid,
                   const std::string& where) {
  if (map.pyramid.levels != pyramid.levels || map.pyramid.scale_factor != pyramid.scale_factor) {
    throw Error(fmt::format("has {} pyramid levels of factor {}, the other map or the run {} of {}",
                            map.pyramid.levels, map.pyramid.scale_factor, pyramid.levels,
                            pyramid.scale_factor),
                where,
                fmt::format("map with --set features.levels={} --set features.scale_factor={}",
                            map.pyramid.levels, map.pyramid.scale_factor));
  }
  return same_images(map.camera, camera) ? std::move(map) : with_camera(std::move(map), camera);
}

}  // namespace stillmap
