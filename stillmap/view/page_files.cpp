// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/page_files.hpp"

#include <algorithm>
#include <array>

/// Embeds a file between the symbols NAME_begin and NAME_end.
#define STILLMAP_EMBED(name, file)      \
  __asm__(                              \
      ".section .rodata\n"              \
      ".global " #name                  \
      "_begin\n"                        \
      ".hidden " #name "_begin\n" #name \
      "_begin:\n"                       \
      ".incbin \"" file                 \
      "\"\n"                            \
      ".global " #name                  \
      "_end\n"                          \
      ".hidden " #name "_end\n" #name   \
      "_end:\n"                         \
      ".byte 0\n"                       \
      ".previous\n");                   \
  extern "C" const char name##_begin[]; \
  extern "C" const char name##_end[]

STILLMAP_EMBED(stillmap_page_html, STILLMAP_PAGE_FOLDER "/index.html");
STILLMAP_EMBED(stillmap_page_css, STILLMAP_PAGE_FOLDER "/view.css");
STILLMAP_EMBED(stillmap_page_js, STILLMAP_PAGE_FOLDER "/view.js");
STILLMAP_EMBED(stillmap_page_icon, STILLMAP_PAGE_FOLDER "/icon.svg");
STILLMAP_EMBED(stillmap_page_three, STILLMAP_THREE_FOLDER "/build/three.min.js");
STILLMAP_EMBED(stillmap_page_orbit, STILLMAP_THREE_FOLDER "/examples/js/controls/OrbitControls.js");

namespace stillmap {
namespace {

std::string_view text(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace

const PageFile* find_page_file(std::string_view path) {
  static const std::array<PageFile, 6> files{{
      {"/", "text/html; charset=utf-8", text(stillmap_page_html_begin, stillmap_page_html_end)},
      {"/view.css", "text/css", text(stillmap_page_css_begin, stillmap_page_css_end)},
      {"/view.js", "text/javascript", text(stillmap_page_js_begin, stillmap_page_js_end)},
      {"/icon.svg", "image/svg+xml", text(stillmap_page_icon_begin, stillmap_page_icon_end)},
      {"/three.min.js", "text/javascript",
       text(stillmap_page_three_begin, stillmap_page_three_end)},
      {"/OrbitControls.js", "text/javascript",
       text(stillmap_page_orbit_begin, stillmap_page_orbit_end)},
  }};
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&](const PageFile& file) { return file.path == path; });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace stillmap
