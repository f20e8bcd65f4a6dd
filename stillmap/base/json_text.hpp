// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include <nlohmann/json.hpp>

namespace stillmap {

/// Returns a JSON value as text. Bytes that are no UTF-8, such as those of a Latin-1 file name,
/// become replacement characters instead of an exception.
/// @param indent  number of spaces per level; negative: one line
inline std::string json_text(const nlohmann::json& json, int indent = -1) {
  return json.dump(indent, ' ', /*ensure_ascii=*/false, nlohmann::json::error_handler_t::replace);
}

}  // namespace stillmap
