// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/static_page.hpp"

#include "stillmap/base/base64.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/view/page_files.hpp"

#include <optional>
#include <stop_token>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Name of a module in the page: modules cannot be found by their paths there.
std::string module_name(std::string_view path) { return "stillmap" + std::string(path); }

void replace_all(std::string& text, std::string_view old, std::string_view by) {
  for (std::size_t at = text.find(old); at != std::string::npos;
       at = text.find(old, at + by.size()))
    text.replace(at, old.size(), by);
}

/// Replaces a part of the page that must be there.
void replace(std::string& text, std::string_view old, std::string_view by) {
  if (text.find(old) == std::string::npos)
    throw Error(fmt::format("index.html has no '{}'", old), "page in one file", "this is a bug");
  replace_all(text, old, by);
}

std::string data_url(std::string_view type, std::string_view content) {
  return fmt::format("data:{};base64,{}", type, base64(content));
}

std::string_view content_of(std::string_view path) { return find_page_file(path)->content; }

bool is_module(const PageFile& file) {
  return file.path.ends_with(".js") && (file.content.find("\nimport ") != std::string_view::npos ||
                                        file.content.find("\nexport ") != std::string_view::npos);
}

std::string import_map() {
  nlohmann::json imports;
  for (const PageFile& file : page_files()) {
    if (!is_module(file)) continue;
    std::string source(file.content);
    replace_all(source, "from './", "from 'stillmap/");
    replace_all(source, "import './", "import 'stillmap/");
    imports[module_name(file.path)] = data_url("text/javascript", source);
  }
  return nlohmann::json{{"imports", imports}}.dump();
}

std::string messages_of(const TopicBoard& board) {
  std::string elements;
  for (std::uint64_t last = 0; last < board.version();) {
    const std::optional<Posting> posting = board.next(last, std::stop_token());
    last = posting->version;
    elements +=
        fmt::format("<script class=\"message\" type=\"text/plain\" data-kind=\"{}\">{}</script>\n",
                    posting->binary ? "binary" : "json", base64(*posting->bytes));
  }
  return elements;
}

}  // namespace

std::string static_page(TopicBoard& board) {
  board.publish(
      {{"type", "images"}, {"problem", "A page in one file has no images of the camera."}});
  std::string page(content_of("/index.html"));
  replace(page, R"(<link rel="stylesheet" href="/view.css">)",
          fmt::format("<style>\n{}</style>", content_of("/view.css")));
  replace(page, "/icon.svg", data_url("image/svg+xml", content_of("/icon.svg")));
  for (const std::string_view path : {"/three.min.js", "/OrbitControls.js"}) {
    replace(page, fmt::format("<script src=\"{}\"></script>", path),
            fmt::format("<script>\n{}</script>", content_of(path)));
  }
  replace(page, R"(<script type="module" src="/main.js"></script>)",
          fmt::format("{}<script type=\"importmap\">{}</script>\n"
                      "<script type=\"module\">import '{}';</script>",
                      messages_of(board), import_map(), module_name("/main.js")));
  return page;
}

}  // namespace stillmap
