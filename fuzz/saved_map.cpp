// SPDX-License-Identifier: Apache-2.0
// The sections of saved maps, not compressed: name (4 bytes), size (4) and content of each.
#include "stillmap/pipeline/saved_map.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/map/map_file.hpp"

#include "fuzz/fuzz_target.hpp"

namespace {

using namespace stillmap;

std::vector<Section> sections_in(std::string_view input) {
  std::vector<Section> sections;
  ByteReader in(input, "input", "");
  while (in.left() >= 8) {
    Section section{in.get<std::array<char, 4>>(), {}};
    const auto size = std::min<std::size_t>(in.get<std::uint32_t>(), in.left());
    const std::vector<char> content = in.get_list<char>(size);
    section.bytes.assign(content.begin(), content.end());
    sections.push_back(std::move(section));
  }
  return sections;
}

/// Returns two keyframes with a common landmark.
Map small_map() {
  Camera camera;
  camera.width = 64, camera.height = 48;
  Map map(camera, PyramidShape{8, 1.2});
  std::vector<KeyframeId> ids;
  for (std::uint64_t i = 0; i < 2; ++i) {
    auto features = std::make_shared<Features>();
    features->keypoints = {{.u = 3, .v = 4, .depth = 2}, {.u = 30, .v = 40, .level = 1}};
    features->descriptors = {{1, 2, 3, i}, {4, 5, 6, i}};
    features->grid = KeypointGrid(features->keypoints, 64, 48);
    Keyframe keyframe;
    keyframe.static_weight = {1, 0.5F};
    keyframe.features = features;
    keyframe.frame_index = i;
    ids.push_back(map.add_keyframe(std::move(keyframe)).id);
  }
  const LandmarkId landmark = map.add_landmark({0, 0, 2}, {ids[0], 0}).id;
  map.observe(landmark, {ids[1], 0});
  map.refresh(landmark);
  return map;
}

AnchoredView small_view() {
  AnchoredView anchored{.anchor = {0, 0}, .T_anchor_camera = {}, .view = {}};
  DenseView& view = anchored.view;
  view.camera.width = 4, view.camera.height = 3;
  view.depth = cv::Mat1w(3, 4, std::uint16_t{10000});
  view.color = cv::Mat3b(3, 4, cv::Vec3b(1, 2, 3));
  view.kind = cv::Mat1b(3, 4, std::uint8_t{kFirstInstance});
  view.instances = {{"chair", 0.5F}};
  return anchored;
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const SavedMap saved{"fuzz", small_map().content(), {small_view()}};
  ByteWriter out;
  for (const Section& section : unpack_sections(kMapFormat, saved_map_bytes(saved), "seed")) {
    out.put(section.name);
    out.put_text(section.bytes);
  }
  return {out.bytes()};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto sections = sections_in(fuzz::text_of(data, size));
  if (sections.size() > 64) return 0;
  const std::string file = pack_sections(kMapFormat, std::move(sections));
  fuzz::parse([&] {
    // A map that was read is written such that it is read again, and can be extended.
    const SavedMap saved = saved_map_from_bytes(file, "input");
    const std::string written = saved_map_bytes(saved);
    if (saved_map_bytes(saved_map_from_bytes(written, "copy")) != written) std::abort();
    const Map map(saved.map);
    if (map.keyframe_count() != saved.map.keyframes.size()) std::abort();
  });
  return 0;
}
