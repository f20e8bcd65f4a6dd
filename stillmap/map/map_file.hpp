// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/base/section_file.hpp"
#include "stillmap/map/map.hpp"

#include <array>
#include <string>
#include <vector>

namespace stillmap {

/// Layout of saved maps: docs/map_file.md. Every change needs a new version number.
constexpr SectionFormat kMapFormat{
    "STILLMAP", 5, "saved map", "create the map again with: stillmap run SEQUENCE --save-map FILE",
    /*oldest=*/2};

/// The section of Map::depth_error(), which only maps with one have.
constexpr std::array<char, 4> kDepthErrorSection{'D', 'E', 'R', 'R'};
std::string depth_error_bytes(const SmoothDepthError& error);

/// Returns a map as the sections CAMR, KEYF, LAND and DERR. The same map gives the same bytes, and
/// so does a map that was read from them.
std::vector<Section> map_sections(const MapContent& content);

/// Returns the map in these sections; other sections are ignored. Throws Error for content that
/// violates the map's invariant: a missing section, numbers that are not finite or out of range,
/// invalid references.
/// @param where  file name for error messages
MapContent map_from_sections(const std::vector<Section>& sections, const std::string& where);

/// Returns a reader of the named section, which must outlive it. Throws Error if the section is
/// missing.
ByteReader section_reader(const std::vector<Section>& sections, std::string_view name,
                          const std::string& where);

}  // namespace stillmap
