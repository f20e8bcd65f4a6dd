// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/view_pager.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/map/map_file.hpp"

#include <cstddef>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace stillmap {

/// View of the dense map with its pose relative to a keyframe of the map, with which it moves.
struct AnchoredView {
  KeyframeId anchor;
  Pose T_anchor_camera;
  DenseView view;
};

/// Returns one more than the largest number of a visit before the present one; 0 without a view.
std::uint16_t end_of_visits(const std::vector<AnchoredView>& views);
/// Gives the views of the present visit the number after the others.
void number_present_visit(std::vector<AnchoredView>& views);

/// Files in the folder of a run: its map, and while it runs its journal.
constexpr const char* kRunMap = "run.map";
constexpr const char* kRunJournal = "run.journal";

/// Content of a saved map.
struct SavedMap {
  std::string writer;  ///< Name and version of the program that wrote the map.
  MapContent map;
  std::vector<AnchoredView> views;  ///< Views of the dense map; empty if it was not saved.
  std::uint32_t version = kMapFormat.version;  ///< Version of the layout of its file.
  std::string damage = {};  ///< What a damaged journal lost, as a sentence; empty: nothing.
};

/// First version of map files whose views have photos.
constexpr std::uint32_t kPhotoVersion = 4;

/// Writes a view as in section DENS of a map file.
void put_view(ByteWriter& out, const DenseView& view);
/// Reads a view. Throws Error if it is damaged.
/// @param camera  of the map
/// @param version of the map file
DenseView get_view(ByteReader& in, const Camera& camera,
                   std::uint32_t version = kMapFormat.version);

/// Reads views that may take more memory than there is: those beyond the limit are moved into a
/// file as they are read.
class ViewReader {
 public:
  /// @param version of the map file
  explicit ViewReader(const MemoryLimit& memory, std::uint32_t version = kMapFormat.version)
      : pager_(memory), version_(version) {}
  /// Reads a view as get_view().
  DenseView read(ByteReader& in, const Camera& camera);

 private:
  ViewPager pager_;
  std::uint32_t version_;
  std::uint64_t in_memory_ = 0;  // pixels of the views in memory [bytes]
};

/// Returns the bytes of a map file: see docs/map_file.md. The same map gives the same bytes.
std::string saved_map_bytes(const SavedMap& saved);

/// Returns the map in the bytes of a file. Throws Error for bytes that are not a map of this
/// program, are truncated, altered, of another version, or inconsistent.
/// @param where  name of the file, for messages
/// @param memory for the views of the dense map
SavedMap saved_map_from_bytes(std::string_view bytes, const std::string& where,
                              const MemoryLimit& memory = {});

/// Writes the file completely or not at all, some views at a time. Throws Error (folder missing,
/// not writable, disk full).
void write_saved_map(const std::filesystem::path& file, const SavedMap& saved);
/// Returns whether a file begins as a saved map does.
bool is_saved_map(const std::filesystem::path& file);
/// Returns the file that read_saved_map() reads: for the folder of a run its journal, if there is
/// one, or else its map.
std::filesystem::path map_file_of(const std::filesystem::path& source);

/// Reads the map of a map file, of the journal of a run that did not end, or of the folder of a
/// run, some views at a time. Throws Error as saved_map_from_bytes(), and if the file cannot be
/// read.
/// @param memory for the views of the dense map
SavedMap read_saved_map(const std::filesystem::path& source, const MemoryLimit& memory = {});

/// Returns a map for frames of this camera, which may be another one than the map's: see
/// with_camera(). Throws Error for another pyramid.
MapContent map_for(MapContent map, const Camera& camera, const PyramidShape& pyramid,
                   const std::string& where);

}  // namespace stillmap
