// SPDX-License-Identifier: Apache-2.0
// A fuzz target gives arbitrary bytes to one parser. libFuzzer varies the bytes (`make fuzz`); the
// tests fuzz.NAME parse the seeds and the inputs of earlier findings (fuzz/findings/NAME).
#pragma once
#include "stillmap/base/error.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Parses one input; every target defines it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace stillmap::fuzz {

/// Returns valid inputs; every target defines it.
std::vector<std::string> seeds();

/// Number of calls of parse() whose parser accepted its input.
inline std::size_t accepted = 0;

/// Why the parser refused the last input that it refused.
extern std::string refusal;

/// Keeps the reason of a refusal.
void refuse(const char* reason);

/// Calls a parser, which may refuse its input by throwing Error. Any other exception ends the
/// program: it is a finding.
template <typename Parser>
void parse(Parser&& parser) {
  try {
    parser();
    ++accepted;
  } catch (const Error& error) {
    refuse(error.what());
  }
}

/// Returns the input as characters.
inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// Writes the bytes to a file of this process and returns its path, for parsers that read files. A
/// later call with the same name replaces the file.
std::filesystem::path file_with(std::string_view bytes, const std::string& name = "input");

/// Returns the content of a file that was written by the code of a test.
std::string content_of(const std::filesystem::path& file);

}  // namespace stillmap::fuzz
