// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/base/section_file.hpp"
#include "stillmap/map/map.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// The layout of saved maps: docs/map_file.md. A new version for every change of it.
constexpr SectionFormat kMapFormat{
    "STILLMAP", 1, "saved map", "map the place anew with: stillmap run SEQUENCE --save-map FILE"};

/// A map as the sections CAMR, KEYF and LAND of a file. The same map gives the same bytes, and so
/// does the map read back from them.
std::vector<Section> map_sections(const MapContent& content);

/// The map in such sections; others are passed over. Throws Error for anything a Map could not be:
/// a missing section, numbers that are not finite or out of range, references to nothing.
/// @param where  the file's name, for messages
MapContent map_from_sections(const std::vector<Section>& sections, const std::string& where);

/// A reader of the section of a name, which must outlive it. Throws Error if there is none.
ByteReader section_reader(const std::vector<Section>& sections, std::string_view name,
                          const std::string& where);

}  // namespace stillmap
