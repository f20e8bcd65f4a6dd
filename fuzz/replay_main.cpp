// SPDX-License-Identifier: Apache-2.0
// Main function of the fuzz targets for compilers without libFuzzer: parses the seeds, each of
// which must be accepted, and all files of the given folders, which need not.
#include "fuzz/fuzz_target.hpp"
#include <fmt/format.h>

namespace {

namespace fs = std::filesystem;
using stillmap::fuzz::accepted;

void parse(const std::string& input) {
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
}

/// Returns the number of seeds that the parser refuses.
int refused_seeds() {
  int number = 0, refused = 0;
  for (const std::string& seed : stillmap::fuzz::seeds()) {
    accepted = 0;
    parse(seed);
    if (accepted == 0) {
      fmt::print("seed {} is refused: {}\n", number, stillmap::fuzz::refusal);
      ++refused;
    }
    ++number;
  }
  fmt::print("{} seeds\n", number);
  return refused;
}

void parse_files(const fs::path& folder) {
  if (!fs::exists(folder)) return;
  for (const auto& entry : fs::directory_iterator(folder)) {
    fmt::print("{}\n", entry.path().string());
    parse(stillmap::fuzz::content_of(entry.path()));
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv);

int main(int argc, char** argv) {
  LLVMFuzzerInitialize(&argc, &argv);
  const int refused = refused_seeds();
  for (int i = 1; i < argc; ++i) parse_files(argv[i]);
  return refused == 0 ? 0 : 1;
}
