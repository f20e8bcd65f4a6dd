// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file.hpp"

#include "stillmap/base/error.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include <fmt/format.h>

namespace stillmap {
namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::ifstream open_file(const fs::path& file) {
  std::error_code failed;
  // A pipe or device may have no end.
  if (fs::exists(file, failed) && !fs::is_directory(file, failed) &&
      !fs::is_regular_file(file, failed)) {
    throw Error("is a pipe or device", file.string(), "copy its content into a file");
  }
  std::ifstream in(file, std::ios::binary);
  if (!in || fs::is_directory(file, failed)) {
    throw Error("cannot be read", file.string(), "check that the file exists and is readable");
  }
  return in;
}

std::string read_file(const fs::path& file, std::uintmax_t largest) {
  std::ifstream in = open_file(file);
  const std::uintmax_t size = fs::file_size(file);
  if (size > largest) {
    throw Error(fmt::format("has {} MB, at most {} are read", size >> 20, largest >> 20),
                file.string(), "check that this is the file that you meant");
  }
  std::string bytes(size, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

void write_file(const fs::path& file, std::string_view content) {
  write_file(file, [&](std::ostream& out) {
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
  });
}

void write_file(const fs::path& file, const std::function<void(std::ostream&)>& write) {
  const fs::path temporary = file.string() + ".part";
  std::error_code absent;
  fs::remove(temporary, absent);  // A link of this name would be followed.
  std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
  if (out) write(out);
  if (out) out.close();
  if (!out) {
    const std::string reason = std::strerror(errno);
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw Error("cannot be written (" + reason + ")", file.string(),
                "check that the folder exists and is writable, and that the disk is not full");
  }
  std::error_code failed;
  fs::rename(temporary, file, failed);
  if (failed) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw Error("cannot be written (" + failed.message() + ")", file.string(),
                "check that no folder has this name");
  }
}

void make_output_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed || !fs::is_directory(folder)) {
    throw Error(
        "the output folder cannot be created" + (failed ? " (" + failed.message() + ")" : ""),
        folder.string(), "give a writable folder with --out DIR");
  }
  const fs::path probe = folder / ".stillmap_probe";
  try {
    write_file(probe, "");
  } catch (const Error&) {
    throw Error("no file can be written there", folder.string(), "name a writable folder");
  }
  fs::remove(probe, failed);
}

}  // namespace stillmap
