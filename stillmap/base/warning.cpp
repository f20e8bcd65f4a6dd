// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/warning.hpp"

#include "stillmap/base/print.hpp"

#include <fmt/format.h>

namespace stillmap {

void warn(const std::string& problem, const std::string& fix) {
  std::string text = "stillmap: warning: " + problem + "\n";
  if (!fix.empty()) text += "  fix: " + fix + "\n";
  print_error("{}", text);
}

}  // namespace stillmap
