// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/brief.hpp"

namespace stillmap {
namespace {

/// ax, ay, bx, by of each comparison, learned by `stillmap_lab brief-pattern`.
constexpr std::int8_t kTable[256][4] = {
#include "stillmap/feature/brief_pattern_table.inc"
};

constexpr BriefPattern pattern_of_table() {
  BriefPattern pattern{};
  for (std::size_t i = 0; i < 256; ++i) {
    pattern.ax[i] = kTable[i][0];
    pattern.ay[i] = kTable[i][1];
    pattern.bx[i] = kTable[i][2];
    pattern.by[i] = kTable[i][3];
  }
  return pattern;
}

constexpr BriefPattern kPattern = pattern_of_table();

}  // namespace

const BriefPattern& brief_pattern() { return kPattern; }

}  // namespace stillmap
