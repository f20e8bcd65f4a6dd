// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <stdexcept>
#include <string>

namespace stillmap {

/// An error that the user can fix. It names the problem, the place and the fix. The command line
/// prints what() and ends with exit code 1; library users catch it around calls of the public API.
class Error : public std::runtime_error {
 public:
  /// @param what  one sentence with the expected and the found value
  /// @param where file, line, key or argument; may be empty
  /// @param fix   advice to the user; may be empty
  Error(const std::string& what, const std::string& where, const std::string& fix)
      : std::runtime_error(join(what, where, fix)), what_(what), where_(where), fix_(fix) {}

  const std::string& problem() const { return what_; }
  const std::string& where() const { return where_; }
  const std::string& fix() const { return fix_; }

 private:
  static std::string join(const std::string& what, const std::string& where,
                          const std::string& fix) {
    std::string text = where.empty() ? what : where + ": " + what;
    if (!fix.empty()) text += "\n  fix: " + fix;
    return text;
  }

  std::string what_, where_, fix_;
};

}  // namespace stillmap
