// SPDX-License-Identifier: Apache-2.0
#include "fuzz/fuzz_target.hpp"

#include <fstream>
#include <iterator>
#include <unistd.h>

#include <fmt/format.h>

namespace stillmap::fuzz {
namespace {

namespace fs = std::filesystem;

/// A temporary folder that is removed when the program ends.
class OwnFolder {
 public:
  OwnFolder() : path_(fs::temp_directory_path() / fmt::format("stillmap_fuzz_{}", getpid())) {
    fs::create_directories(path_);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  ~OwnFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void write(const fs::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Writes the seeds to a folder, from which libFuzzer starts.
void write_seeds(const fs::path& folder) {
  fs::create_directories(folder);
  int number = 0;
  for (const std::string& seed : seeds()) write(folder / fmt::format("seed_{}", number++), seed);
}

}  // namespace

std::string refusal;

void refuse(const char* reason) { refusal = reason; }

fs::path file_with(std::string_view bytes, const std::string& name) {
  static const OwnFolder folder;
  const fs::path file = folder.path() / name;
  write(file, bytes);
  return file;
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace stillmap::fuzz

/// `TARGET --write-seeds FOLDER` writes the seeds and ends, also if libFuzzer has the main
/// function.
extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc != 3 || std::string_view((*argv)[1]) != "--write-seeds") return 0;
  stillmap::fuzz::write_seeds((*argv)[2]);
  std::exit(0);
}
