// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/print.hpp"

#include <atomic>
#include <cerrno>

namespace stillmap {
namespace {

std::atomic<bool> output_lost = false;

void note_failure(std::FILE* stream) noexcept {
  if (stream == stdout && errno != EPIPE) output_lost = true;
}

}  // namespace

void write_text(std::FILE* stream, std::string_view text) noexcept {
  if (std::fwrite(text.data(), 1, text.size(), stream) != text.size()) note_failure(stream);
}

bool output_is_complete() noexcept {
  if (std::fflush(stdout) != 0) note_failure(stdout);
  return !output_lost;
}

}  // namespace stillmap
