// SPDX-License-Identifier: Apache-2.0
#include "terminal.hpp"

#include "stillmap/base/print.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <sstream>
#include <string_view>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Width without a terminal, least width for wrapping, and least width for descriptions beside the
/// names of options.
constexpr std::size_t kDefaultColumns = 100, kLeastColumns = 16, kBesideNames = 60;

/// Returns the column of the descriptions.
std::size_t description_column(std::size_t columns) {
  return columns < kBesideNames ? std::min<std::size_t>(6, columns / 4) : 26;
}

class WrappedHelp final : public CLI::Formatter {
 public:
  explicit WrappedHelp(std::size_t columns)
      : columns_(columns), descriptions_(description_column(columns)) {
    column_width(descriptions_);
  }

  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return entry(make_option_name(option, is_positional) + make_option_opts(option),
                 make_option_desc(option));
  }
  /// Returns the value that an option takes, with its default.
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text;
    if (option->get_type_size() != 0) {
      const std::string type = value_type(*option);
      text += " " + type;
      if (!option->get_default_str().empty()) text += "=" + option->get_default_str();
      const int most = option->get_expected_max();
      if (most == CLI::detail::expected_max_vector_size) {
        text += " ...";
      } else if (most > 1 && type.find(',') == std::string::npos) {
        text += fmt::format(" x {}", most);
      }
    }
    if (option->get_required()) text += " (required)";
    return text;
  }
  /// Returns the description, with the options that it needs or excludes.
  std::string make_option_desc(const CLI::Option* option) const override {
    const std::string needs = names_of(option->get_needs());
    const std::string excludes = names_of(option->get_excludes());
    std::string text = option->get_description();
    if (!needs.empty()) text += " (with " + needs + ")";
    if (!excludes.empty()) text += " (not with " + excludes + ")";
    return text;
  }
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override {
    return CLI::Formatter::make_group(styled(group, Style::kBold, STDOUT_FILENO), is_positional,
                                      std::move(options));
  }
  std::string make_footer(const CLI::App* command) const override {
    std::string text;
    std::istringstream lines(command->get_footer());
    for (std::string line; std::getline(lines, line);) text += footer_line(line) + "\n";
    return text;
  }
  std::string make_usage(const CLI::App* command, std::string name) const override {
    return fitted(CLI::Formatter::make_usage(command, std::move(name)), columns_);
  }
  std::string make_description(const CLI::App* command) const override {
    return fitted(CLI::Formatter::make_description(command), columns_);
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return entry(command->get_name(), command->get_description());
  }

 private:
  /// Returns the names of the options that the help shows.
  static std::string names_of(const std::set<CLI::Option*>& options) {
    std::vector<std::string> names;
    for (const CLI::Option* option : options) {
      if (!option->get_group().empty()) names.push_back(option->get_name());
    }
    std::sort(names.begin(), names.end());
    return fmt::format("{}", fmt::join(names, ", "));
  }
  /// Returns a line of a footer: a heading, an example, or a text behind a name and two blanks.
  std::string footer_line(const std::string& line) const {
    const auto begin = std::min(line.find_first_not_of(' '), line.size());
    if (begin == 0 && line.ends_with(':')) return styled(line, Style::kBold, STDOUT_FILENO);
    // Examples stay on one line, so that they can be copied.
    if (line.compare(begin, 9, "stillmap ") == 0) return line;
    const bool is_entry = line.find("  ", begin) != line.npos;
    return is_entry ? fitted(line, columns_)
                    : line.substr(0, begin) + wrapped(line.substr(begin), begin, columns_);
  }
  std::string entry(const std::string& name, const std::string& description) const {
    std::string text = "  " + wrapped(name, 4, columns_);
    if (description.empty()) return text + "\n";
    const std::size_t used = text.size() - std::min(text.size(), text.rfind('\n') + 1);
    text += used + 1 < descriptions_ ? std::string(descriptions_ - used, ' ')
                                     : "\n" + std::string(descriptions_, ' ');
    return text + wrapped(description, descriptions_, columns_) + "\n";
  }

  std::size_t columns_, descriptions_;
};

}  // namespace

std::string value_type(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t checks = type.find(':');
  if (checks != std::string::npos && type[checks + 1] == '{' &&
      type.find(',', checks) != std::string::npos)
    return type.substr(checks + 1);
  const std::string name = type.substr(0, checks);
  if (name == "INT" || name == "UINT") return "N";
  return name == "FLOAT" ? "X" : name;
}

std::string wrapped(const std::string& text, std::size_t indent, std::size_t columns) {
  std::string result;
  std::size_t used = indent;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (used > indent && used + 1 + word.size() > columns) {
      result += "\n" + std::string(indent, ' ');
      used = indent;
    } else if (used > indent) {
      result += ' ';
      ++used;
    }
    result += word;
    used += word.size();
  }
  return result;
}

std::size_t help_columns() {
  return std::max(terminal_columns(STDOUT_FILENO).value_or(kDefaultColumns), kLeastColumns);
}

bool takes_codes(int file_descriptor) {
  const char* terminal = std::getenv("TERM");
  return isatty(file_descriptor) != 0 &&
         !(terminal != nullptr && std::string_view(terminal) == "dumb");
}

std::string styled(const std::string& text, Style style, int file_descriptor) {
  const char* no_color = std::getenv("NO_COLOR");
  if (!takes_codes(file_descriptor) || (no_color != nullptr && *no_color != '\0')) return text;
  // Select Graphic Rendition (ECMA-48, 8.3.117).
  const char* code = style == Style::kBold ? "1" : style == Style::kRed ? "1;31" : "33";
  return std::string("\033[") + code + "m" + text + "\033[0m";
}

std::string open_line(const std::filesystem::path& file, const std::string& alternative) {
  return styled("Open " + file.string(), Style::kBold, STDOUT_FILENO) + alternative + "\n";
}

std::shared_ptr<CLI::Formatter> make_help_formatter() {
  return std::make_shared<WrappedHelp>(help_columns());
}

}  // namespace stillmap
