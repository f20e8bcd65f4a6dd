// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace stillmap {

/// Returns a text as UTF-8 without byte order mark. Texts that begin with the mark of UTF-16, as
/// editors and shells of Windows write them, are converted; all others stay as they are.
std::string as_utf8(std::string_view text);

}  // namespace stillmap
