// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/result_folder.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fcntl.h>
#include <map>
#include <mutex>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

/// Names of the results of versions without a manifest.
constexpr std::array kNamesBeforeManifest{"trajectory.txt",
                                          "keyframes.txt",
                                          "cloud.ply",
                                          "cloud.pcd",
                                          "cloud.png",
                                          "cloud_before_after.png",
                                          "movers.csv",
                                          "movers.jsonl",
                                          "movers.png",
                                          "semantic.ply",
                                          "semantic_classes.ply",
                                          "semantic_legend.png",
                                          "semantic.png",
                                          "objects.json",
                                          "mesh.ply",
                                          "mesh.obj",
                                          "mesh.glb",
                                          "mesh.mtl",
                                          "mesh_texture.png",
                                          "mesh.png",
                                          "octomap.bt",
                                          "grid.pgm",
                                          "grid.yaml",
                                          "obstacles.json",
                                          "obstacles.jsonl",
                                          "run.map",
                                          "options.yaml",
                                          "timing.txt",
                                          "summary.json",
                                          "report.html",
                                          "profile.txt",
                                          "profile.png",
                                          "trace.json",
                                          "verdicts.bin"};

/// Returns whether the name is that of a file inside the folder: a manifest that was tampered with
/// must not affect any other file.
bool stays_inside(const fs::path& name) {
  return !name.empty() && name.is_relative() && name == name.lexically_normal() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& part) { return part == ".."; });
}

nlohmann::json parsed(const fs::path& file) {
  return nlohmann::json::parse(read_file(file), nullptr, /*allow_exceptions=*/false);
}

std::set<std::string> names_in_manifest(const fs::path& file) {
  const nlohmann::json manifest = parsed(file);
  const auto require = [&](bool valid) {
    if (valid) return;
    throw Error("is damaged", file.string(),
                "remove it, and add --force to replace the results in its folder");
  };
  require(manifest.is_object() && manifest.contains("files"));
  std::set<std::string> names;
  for (const nlohmann::json& name : manifest["files"]) {
    require(name.is_string() && stays_inside(name.get<std::string>()));
    names.insert(name.get<std::string>());
  }
  return names;
}

std::set<std::string> own_names(const fs::path& folder) {
  if (fs::exists(folder / kManifestName)) return names_in_manifest(folder / kManifestName);
  const fs::path summary = folder / "summary.json";
  if (!fs::is_regular_file(summary)) return {};
  const nlohmann::json json = parsed(summary);
  if (!json.is_object() || !json.contains("stillmap")) return {};
  std::set<std::string> names;
  for (const char* name : kNamesBeforeManifest)
    if (fs::exists(folder / name)) names.insert(name);
  return names;
}

/// Locks an open folder. Returns false if another process has locked it; a file system without
/// locks gives none.
bool lock(int descriptor) {
  return ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

/// Creates the folder and locks it against other processes until the returned object is destroyed;
/// objects of this process share the lock.
std::shared_ptr<const void> locked(const fs::path& folder) {
  static std::mutex mutex;
  static std::map<fs::path, std::weak_ptr<const void>> locks;
  make_output_folder(folder);
  const std::scoped_lock guard(mutex);
  auto& known = locks[fs::canonical(folder)];
  if (auto lock = known.lock()) return lock;
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0 && !lock(descriptor)) {
    ::close(descriptor);
    throw Error("another run writes its results to this folder", folder.string(),
                "wait for its end, or name another folder with --out DIR");
  }
  std::shared_ptr<const void> held_lock(new int(descriptor), [](const void* held) {
    const auto* number = static_cast<const int*>(held);
    if (*number >= 0) ::close(*number);
    delete number;
  });
  known = held_lock;
  return held_lock;
}

Error foreign_file(const fs::path& file) {
  return {"exists already, and Stillmap did not write it", file.string(),
          "name another folder with --out DIR, or add --force to overwrite the file"};
}

}  // namespace

bool is_written_to(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool is_free = lock(descriptor);
  ::close(descriptor);
  return !is_free;
}

ResultFolder::ResultFolder(fs::path folder, Foreign foreign)
    : folder_(std::move(folder)), lock_(locked(folder_)), foreign_(foreign) {
  own_ = own_names(folder_);
}

bool ResultFolder::is_foreign(const std::string& name) const {
  return foreign_ == Foreign::kKeep && !own_.contains(name) &&
         fs::exists(fs::symlink_status(folder_ / name));
}

void ResultFolder::require_free(std::span<const std::string> names) const {
  for (const std::string& name : names)
    if (is_foreign(name)) throw foreign_file(folder_ / name);
}

bool ResultFolder::write(const std::string& name,
                         const std::function<void(const fs::path&)>& writer) {
  const fs::path file = folder_ / name;
  const std::string problems = problems_;
  try {
    if (is_foreign(name)) throw foreign_file(file);
    if (file.has_parent_path()) fs::create_directories(file.parent_path());
    // The manifest is written before the file, so that after an interruption no file of Stillmap's
    // is taken for a foreign one.
    if (own_.insert(name).second) save_manifest();
    writer(file);
    if (current_.insert(name).second) written_.push_back(file);
    return true;
  } catch (const std::exception& e) {
    const std::string problem = e.what();  // of the file, or of the manifest before it
    const bool names_file = problem.find(file.string()) != std::string::npos;
    problems_ += (names_file ? "" : file.string() + ": ") + problem + "\n";
  }
  if (makes_room(name)) {
    problems_ = problems;
    return write(name, writer);
  }
  // The file of an earlier run is not taken for that of this run.
  if (!current_.contains(name) && !is_foreign(name) && forget(name))
    problems_ += file.string() + ": the one that was there was removed\n";
  return false;
}

/// Removes the spare file if it takes room that another file needs. Returns whether it did.
bool ResultFolder::makes_room(const std::string& name) {
  constexpr std::uintmax_t kScarce = 64 << 20;  // [bytes]
  std::error_code failed;
  const auto free = fs::space(folder_, failed).available;
  if (failed || free > kScarce || spare_.empty() || spare_ == name || is_foreign(name))
    return false;
  return forget(std::exchange(spare_, ""));
}

void ResultFolder::write_drawing(const std::string& name,
                                 const std::function<void(const fs::path&)>& writer) {
  if (!draws_) return;
  drawings_.push_back(name);
  draws_ = write(name, writer);
  if (draws_) return;
  for (const std::string& drawing : drawings_) forget(drawing);
  problems_ += "the drawings were removed to make room for the results\n";
}

void ResultFolder::write_text(const std::string& name, std::string_view content) {
  write(name, [&](const fs::path& file) { write_file(file, content); });
}

void ResultFolder::write_elsewhere(const fs::path& file,
                                   const std::function<void(const fs::path&)>& writer) {
  try {
    writer(file);
    written_.push_back(file);
  } catch (const Error& e) {
    problems_ += std::string(e.what()) + "\n";
  }
}

void ResultFolder::remove_own(std::span<const std::string> names) {
  for (const std::string& name : names) {
    std::error_code ignored;
    if (own_.contains(name)) fs::remove(folder_ / name, ignored);
  }
}

bool ResultFolder::wrote(std::span<const std::string> names) const {
  return std::all_of(names.begin(), names.end(),
                     [&](const std::string& name) { return current_.contains(name); });
}

/// Removes a file of Stillmap's, also from the list of written ones. Returns whether it was there.
bool ResultFolder::forget(const std::string& name) {
  current_.erase(name);
  std::erase(written_, folder_ / name);
  std::error_code failed;
  return own_.contains(name) && fs::remove(folder_ / name, failed);
}

void ResultFolder::remove_stale() {
  if (!problems_.empty()) return;
  for (const std::string& name : own_) {
    if (current_.contains(name)) continue;
    std::error_code failed;
    fs::remove(folder_ / name, failed);
    if (failed) {
      problems_ += (folder_ / name).string() + " cannot be removed: " + failed.message() + "\n";
      continue;
    }
    const fs::path parent = fs::path(name).parent_path();
    if (!parent.empty()) fs::remove(folder_ / parent, failed);  // fails unless it is empty now
  }
  own_ = current_;
  save_manifest();
}

void ResultFolder::save_manifest() const {
  const nlohmann::json manifest{{"stillmap", STILLMAP_VERSION}, {"files", own_}};
  write_file(folder_ / kManifestName, json_text(manifest, 1) + "\n");
}

std::string ResultFolder::written_text() const {
  std::string text = "written:\n";
  std::map<fs::path, int> subfolders;
  for (const fs::path& file : written_) {
    const fs::path parent = file.lexically_relative(folder_).parent_path();
    const bool below = !parent.empty() && *parent.begin() != "..";
    if (below) ++subfolders[folder_ / parent];
    if (!below) text += fmt::format("  {}\n", file.string());
  }
  for (const auto& [subfolder, files] : subfolders)
    text += fmt::format("  {} ({})\n", subfolder.string(), counted(files, "file"));
  return text;
}

void ResultFolder::require_all() const {
  if (!problems_.empty()) throw Error("not all results could be saved:\n" + problems_, "", "");
}

}  // namespace stillmap
