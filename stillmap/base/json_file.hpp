// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

namespace stillmap {

/// Calls a function that takes values out of a JSON file, and returns what it returns. Throws Error
/// where the text is no JSON, or a value is missing or of another type.
/// @param fix  advice to the user
template <typename Read>
auto with_json_of(const std::filesystem::path& file, const std::string& fix, Read&& read) {
  try {
    return read();
  } catch (const nlohmann::json::parse_error&) {
    throw Error("is no valid JSON", file.string(), fix);
  } catch (const nlohmann::json::exception& e) {
    const std::string text = e.what();  // [json.exception.KIND.NUMBER] reason
    throw Error("has a value that is not as expected: " + text.substr(text.find(']') + 2),
                file.string(), fix);
  }
}

}  // namespace stillmap
