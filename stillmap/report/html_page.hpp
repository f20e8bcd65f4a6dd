// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace stillmap {

/// Returns a self-contained HTML page with the common style sheet: no scripts, no external
/// resources, light or dark as the reader's system is, printable on A4.
/// @param title  plain text
/// @param body   HTML
/// @param footer HTML
std::string html_page(const std::string& title, const std::string& body, const std::string& footer);

/// Returns a card with a heading and a note, both HTML; empty text if there is no content.
std::string html_card(const std::string& heading, const std::string& content,
                      const std::string& note = "");

/// Returns a chart as wide as the page, which is scrolled on a narrow screen instead of shrunk.
std::string wide_chart(const std::string& chart);

}  // namespace stillmap
