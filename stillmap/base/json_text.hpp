// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include <nlohmann/json.hpp>

namespace stillmap {

/// Replaces every -0.0 of a JSON value by 0.0: the sign says nothing, and readers that compare
/// texts or test for a minus would take it for a negative number.
inline void clear_negative_zeros(nlohmann::json& json) {
  if (json.is_number_float() && json.get<double>() == 0) json = 0.0;
  if (json.is_structured()) {
    for (nlohmann::json& part : json) clear_negative_zeros(part);
  }
}

/// Returns a JSON value as text, without -0.0. Bytes that are no UTF-8, such as those of a Latin-1
/// file name, become replacement characters instead of an exception.
/// @param indent  number of spaces per level; negative: one line
inline std::string json_text(nlohmann::json json, int indent = -1) {
  clear_negative_zeros(json);
  return json.dump(indent, ' ', /*ensure_ascii=*/false, nlohmann::json::error_handler_t::replace);
}

}  // namespace stillmap
