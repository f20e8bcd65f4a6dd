// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string_view>

namespace stillmap {

/// A file of the page, embedded into the program.
struct PageFile {
  std::string_view path;  ///< Path in the address, such as "/main.js".
  std::string_view type;  ///< Media type.
  std::string_view content;
};

/// Returns all files of the page.
std::span<const PageFile> page_files();

/// Returns the file with this path, for "/" that of "/index.html"; null if there is none.
const PageFile* find_page_file(std::string_view path);

}  // namespace stillmap
