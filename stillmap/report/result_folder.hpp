// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// The file in a folder of results that lists the files which Stillmap wrote there.
constexpr const char* kManifestName = ".stillmap-manifest.json";

/// Folder for results. Its manifest distinguishes Stillmap's own files, which may be replaced and
/// removed, from foreign ones, which are never changed. In a folder written by an older version (no
/// manifest, but a summary.json of Stillmap), files with the names of results count as Stillmap's
/// own.
class ResultFolder {
 public:
  enum class Foreign {
    kKeep,       ///< Foreign files are never overwritten; an Error names the file.
    kOverwrite,  ///< Foreign files of the same name are overwritten (--force).
  };

  /// Creates the folder if it does not exist. Throws Error if it cannot be written to, if the
  /// manifest is damaged, or while another process has an object of this class for the folder.
  explicit ResultFolder(std::filesystem::path folder, Foreign foreign = Foreign::kKeep);

  const std::filesystem::path& path() const { return folder_; }

  /// Throws Error for the first of these files that exists and is foreign. Names are relative to
  /// the folder. For a check before a long computation.
  void require_free(std::span<const std::string> names) const;

  /// Writes one file of the folder by calling `writer` with its path; parent folders are created.
  /// An Error of the writer, or for a foreign file in the way, is kept for require_all(), so that
  /// it does not prevent the other files from being written.
  /// @returns whether the file was written
  bool write(const std::string& name,
             const std::function<void(const std::filesystem::path&)>& writer);
  void write_text(const std::string& name, std::string_view content);
  /// Writes one image of a run in progress; errors as in write(). Once one cannot be written, all
  /// are removed and no more are written: on a full disk the results need the space.
  void write_drawing(const std::string& name,
                     const std::function<void(const std::filesystem::path&)>& writer);
  /// Names a file of this folder that is removed once another one cannot be written since the disk
  /// is full.
  void make_room_by(const std::string& name) { spare_ = name; }
  /// Writes one file outside the folder, which the user named explicitly; errors as in write().
  void write_elsewhere(const std::filesystem::path& file,
                       const std::function<void(const std::filesystem::path&)>& writer);

  /// Removes Stillmap's own files of these names. The files that a folder is complete with are
  /// removed first and written last, so that a folder with parts of two runs cannot be mistaken for
  /// the results of one.
  void remove_own(std::span<const std::string> names);

  /// Removes a file of Stillmap's that is of no use any more.
  void discard(const std::string& name) { forget(name); }

  /// Returns whether there was no problem so far.
  bool is_complete() const { return problems_.empty(); }

  /// Returns whether these files were written through this object.
  bool wrote(std::span<const std::string> names) const;

  /// Removes the files of the manifest that were not written through this object. After a problem
  /// nothing is removed.
  void remove_stale();

  /// Returns the list of the written files for the user; files of a subfolder are summarized in one
  /// line.
  std::string written_text() const;

  /// Returns the written files, in the order of writing.
  const std::vector<std::filesystem::path>& written() const { return written_; }

  /// Throws Error, with all problems, if a file could not be written.
  void require_all() const;

 private:
  bool makes_room(const std::string& name);
  bool is_foreign(const std::string& name) const;
  bool forget(const std::string& name);
  void save_manifest() const;

  const std::filesystem::path folder_;
  const std::shared_ptr<const void> lock_;
  const Foreign foreign_;
  std::set<std::string> own_;      // relative names of all files that Stillmap ever wrote here
  std::set<std::string> current_;  // relative names of the files written through this object
  std::vector<std::filesystem::path> written_;
  std::vector<std::string> drawings_;
  bool draws_ = true;
  std::string spare_;  // see make_room_by()
  std::string problems_;
};

/// Returns whether a process has a ResultFolder of this folder.
bool is_written_to(const std::filesystem::path& folder);

}  // namespace stillmap
