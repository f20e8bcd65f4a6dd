// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <string>

namespace stillmap::test {

/// For tests: returns the text of the Error that a call throws; empty if it throws none.
template <typename Call>
std::string error_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace stillmap::test
