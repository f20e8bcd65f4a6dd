// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/page_files.hpp"

#include <algorithm>
#include <array>

/// Embeds a file between the symbols NAME_begin and NAME_end.
#define STILLMAP_PAGE_FILE(name, path, file) \
  __asm__(                                   \
      ".section .rodata\n"                   \
      ".global " #name                       \
      "_begin\n"                             \
      ".hidden " #name "_begin\n" #name      \
      "_begin:\n"                            \
      ".incbin \"" file                      \
      "\"\n"                                 \
      ".global " #name                       \
      "_end\n"                               \
      ".hidden " #name "_end\n" #name        \
      "_end:\n"                              \
      ".byte 0\n"                            \
      ".previous\n");                        \
  extern "C" const char name##_begin[];      \
  extern "C" const char name##_end[];
// A line STILLMAP_PAGE_FILE(NAME, PATH, FILE) for each file; made by CMake.
#include STILLMAP_PAGE_TABLE
#undef STILLMAP_PAGE_FILE

namespace stillmap {
namespace {

PageFile page_file(std::string_view path, const char* begin, const char* end) {
  std::string_view type = "text/javascript";
  if (path.ends_with(".html")) type = "text/html; charset=utf-8";
  if (path.ends_with(".css")) type = "text/css";
  if (path.ends_with(".svg")) type = "image/svg+xml";
  return {path, type, {begin, static_cast<std::size_t>(end - begin)}};
}

}  // namespace

std::span<const PageFile> page_files() {
#define STILLMAP_PAGE_FILE(name, path, file) page_file(path, name##_begin, name##_end),
  static const auto files = std::to_array<PageFile>({
#include STILLMAP_PAGE_TABLE
  });
  return files;
}

const PageFile* find_page_file(std::string_view path) {
  if (path == "/") path = "/index.html";
  const auto files = page_files();
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&](const PageFile& file) { return file.path == path; });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace stillmap
