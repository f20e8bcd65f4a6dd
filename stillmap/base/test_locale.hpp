// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/test_path.hpp"

#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace stillmap::test {

/// Sets a locale with decimal commas, as programs with Qt or GTK do, until it is destroyed.
class DecimalCommas {
 public:
  DecimalCommas() {
    std::filesystem::create_directories(folder_);
    // The locale is compiled here, since few machines have it installed.
    const std::string compile =
        "localedef -i de_DE -f UTF-8 " + (folder_ / "de_DE.UTF-8").string() + " >/dev/null 2>&1";
    // NOLINTNEXTLINE(bugprone-command-processor): the command contains no input
    const bool compiled = std::system(compile.c_str()) == 0;
    is_set_ = compiled && setenv("LOCPATH", folder_.c_str(), 1) == 0 &&
              std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
  }
  DecimalCommas(const DecimalCommas&) = delete;
  DecimalCommas& operator=(const DecimalCommas&) = delete;
  ~DecimalCommas() {
    std::setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
    std::filesystem::remove_all(folder_);
  }

  /// Whether the locale could be compiled (Debian: needs the package locales).
  bool is_set() const { return is_set_; }

 private:
  std::filesystem::path folder_ = own_path("locale");
  bool is_set_ = false;
};

}  // namespace stillmap::test
