// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>

namespace stillmap {

/// Returns the base64 code of some bytes (RFC 4648, section 4).
std::string base64(std::string_view bytes);

}  // namespace stillmap
