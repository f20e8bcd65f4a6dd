// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/captioned_image.hpp"

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

/// Returns an image, which is inside the page, with its caption; empty text without an image.
std::string html_figure(const CaptionedImage& image);

/// Returns a chart as wide as the page, which is scrolled on a narrow screen instead of shrunk.
std::string wide_chart(const std::string& chart);

}  // namespace stillmap
