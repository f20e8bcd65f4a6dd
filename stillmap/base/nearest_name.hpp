// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace stillmap {

/// "did you mean 'x'? Known: a, b, c": advice for a name that is none of the known ones; the
/// nearest by edit distance (Levenshtein 1966) is suggested when it is close enough to be a slip of
/// the hand.
std::string suggestion(const std::string& name, const std::vector<std::string>& known);

}  // namespace stillmap
