// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace stillmap {

/// Returns a text as UTF-8 without byte order mark. UTF-16 is recognized by its byte order mark, as
/// editors and shells of Windows write it. Other texts are returned unchanged.
std::string as_utf8(std::string_view text);

}  // namespace stillmap
