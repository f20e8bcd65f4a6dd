// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/make_source.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/halved.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <filesystem>
#include <string_view>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kForms =
    "name a folder in TUM layout (rgb.txt, depth.txt): FOLDER or tum:FOLDER";
constexpr std::string_view kTum = "tum:";

/// The folder that the text names. Only a text of the form "word:..." can name anything else; a
/// folder may have a colon in its name, too.
std::string folder_of(const std::string& text) {
  if (text.empty()) throw Error("no source of frames was named", "make_source", kForms);
  if (text.starts_with(kTum)) return text.substr(kTum.size());
  const auto colon = text.find(':');
  const bool scheme = colon != std::string::npos && colon > 1 && text.find('/') > colon &&
                      !std::filesystem::exists(text);
  if (scheme) {
    throw Error(fmt::format("there is no kind of source '{}'", text.substr(0, colon)),
                "make_source", kForms);
  }
  return text;
}

Camera camera_of(const SourceOptions& options, const SequencePaths& paths) {
  if (options.recorded) return *options.recorded;
  if (!options.camera.empty()) return read_camera(options.camera);
  if (!paths.camera.empty()) return read_camera(paths.camera.string());
  throw Error("the sequence has no camera.yaml, and no camera was named", paths.folder.string(),
              fmt::format("add --camera NAME or FILE; the names are {}",
                          fmt::join(camera_presets(), ", ")));
}

}  // namespace

std::unique_ptr<FrameSource> make_source(const std::string& text, const SourceOptions& options) {
  const SequencePaths paths = find_sequence(folder_of(text), options.associations);
  const TumFolderOptions range{
      .first = options.first, .count = options.count, .stride = options.stride};
  std::unique_ptr<FrameSource> source =
      std::make_unique<TumFolder>(paths, camera_of(options, paths), range);
  if (options.half_size) source = std::make_unique<HalvedSource>(std::move(source));
  return source;
}

Camera recorded_camera(const std::string& text, const SourceOptions& options) {
  return camera_of(options, find_sequence(folder_of(text), options.associations));
}

}  // namespace stillmap
