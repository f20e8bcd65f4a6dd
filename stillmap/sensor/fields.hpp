// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

namespace stillmap {

/// Returns the fields of a line, which blanks or commas separate.
inline std::vector<std::string> fields_of(std::string line) {
  std::replace(line.begin(), line.end(), ',', ' ');
  std::istringstream stream(line);
  std::vector<std::string> fields;
  for (std::string field; stream >> field;) fields.push_back(field);
  return fields;
}

}  // namespace stillmap
