// SPDX-License-Identifier: Apache-2.0
#include "output_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/config/write_options.hpp"
#include "stillmap/map/map_file.hpp"

#include <fstream>
#include <string>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

bool begins_with(const std::filesystem::path& file, std::string_view text) {
  std::string start(text.size(), ' ');
  std::ifstream(file, std::ios::binary)
      .read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == text;
}

}  // namespace

std::FILE* standard_output_for_data() {
  std::fflush(stdout);
  const int data = ::dup(STDOUT_FILENO);
  std::FILE* const stream = data < 0 ? nullptr : ::fdopen(data, "w");
  if (stream == nullptr || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0)
    throw Error("cannot be used for data", "standard output", "open it for the program");
  return stream;
}

bool is_options_file(const std::filesystem::path& file) {
  return begins_with(file, kOptionsFileTitle);
}

bool is_figures_file(const std::filesystem::path& file) {
  const auto json = nlohmann::json::parse(read_file(file), nullptr, /*allow_exceptions=*/false);
  return json.is_object() && json.contains("stillmap");
}

bool is_static_page(const std::filesystem::path& file) {
  return read_file(file).find("<script class=\"message\"") != std::string::npos;
}

void require_replaceable(const std::filesystem::path& file,
                         bool (*is_own)(const std::filesystem::path&), bool force) {
  if (file.empty() || file == kStandardOutput || !std::filesystem::exists(file)) return;
  if (std::filesystem::is_directory(file))
    throw Error("is a folder", file.string(), "name a file to write");
  if (force || is_own(file)) return;
  throw Error("exists already, and Stillmap did not write it", file.string(),
              "name another file, or add --force to overwrite this one");
}

void write_named(const std::filesystem::path& file, std::string_view text,
                 bool (*is_own)(const std::filesystem::path&), bool force) {
  if (file == kStandardOutput) {
    write_text(stdout, text);
    return;
  }
  require_replaceable(file, is_own, force);
  write_file(file, text);
  print_out("written: {}\n", file.string());
}

}  // namespace stillmap
