// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace stillmap {

/// Returns the known name with the smallest edit distance, on a tie the first one. `known` must not
/// be empty.
std::string nearest_name(const std::string& name, const std::vector<std::string>& known);

/// Returns advice for an unknown name: "did you mean 'x'? Known: a, b, c". The nearest name by edit
/// distance (Levenshtein 1966), or one that begins with the given name, is suggested if it is close
/// enough to be a typing error. Of a long list only the nearest names are named: "did you mean 'x'?
/// The nearest are: x, y, z".
std::string suggestion(const std::string& name, const std::vector<std::string>& known);

}  // namespace stillmap
