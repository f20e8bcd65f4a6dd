// SPDX-License-Identifier: Apache-2.0
// Reads all frames of a source, as `stillmap run` does before it maps them, and prints the time of
// opening it the first and the second time, the time of its images, and both as rates. The file is
// read once before, so that the disk does not count.
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <filesystem>
#include <fstream>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

namespace fs = std::filesystem;

struct ReadArguments {
  std::string source;
  SourceOptions options;
};

// Returns the size of a file, or of all files in a folder [bytes], and reads them into the cache.
std::uintmax_t size_of(const fs::path& path) {
  if (fs::is_directory(path)) {
    std::uintmax_t sum = 0;
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.is_regular_file()) sum += size_of(entry.path());
    }
    return sum;
  }
  std::ifstream in(path, std::ios::binary);
  std::vector<char> buffer(1 << 20);
  std::uintmax_t size = 0;
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0)
    size += static_cast<std::uintmax_t>(in.gcount());
  return size;
}

void measure(const ReadArguments& arguments) {
  const double megabytes = static_cast<double>(size_of(arguments.source)) / 1e6;
  Stopwatch watch;
  make_source(arguments.source, arguments.options);
  const double first = watch.lap() / 1000;
  const auto source = make_source(arguments.source, arguments.options);
  const double second = watch.lap() / 1000;
  std::size_t frames = 0;
  while (source->next()) ++frames;
  const double reading = watch.lap() / 1000;
  const auto images = static_cast<double>(2 * frames);
  fmt::print(
      "{:.1f} MB, {} frames; opened in {:.3f} s, again in {:.3f} s; images {:.3f} s: "
      "{:.0f} images/s; with opening {:.0f} images/s, {:.0f} MB/s\n",
      megabytes, frames, first, second, reading, images / reading, images / (first + reading),
      megabytes / (first + reading));
}

}  // namespace

void add_read_command(CLI::App& app) {
  auto arguments = std::make_shared<ReadArguments>();
  CLI::App* command =
      app.add_subcommand("read", "speed of reading a recorded file or folder, without mapping it");
  command->add_option("source", arguments->source, "recorded file or folder of images")->required();
  command->add_option("--camera", arguments->options.camera, "camera preset or file");
  command->callback([arguments] { measure(*arguments); });
}

}  // namespace stillmap::lab
