// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/report.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/report_charts.hpp"
#include "stillmap/evaluate/report_style.hpp"
#include "stillmap/evaluate/svg.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {
namespace {

constexpr std::size_t kListed = 12;  // of many alike lines; the rest is counted
constexpr int kJpegQuality = 86;

std::string e(std::string_view text) { return escape_markup(text); }

/// Groups of three digits, with thin spaces between: 18 204.
std::string grouped(std::size_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += "\u202f";
    text += digits[i];
  }
  return text;
}

/// Three digits: 950, 18.2 k, 1.23 M.
std::string rounded(std::size_t number) {
  const auto value = static_cast<double>(number);
  if (number < 1000) return std::to_string(number);
  return number < 999500 ? fmt::format("{:.3g}\u2009k", value / 1e3)
                         : fmt::format("{:.3g}\u2009M", value / 1e6);
}

/// RFC 4648.
std::string base64(const std::vector<unsigned char>& bytes) {
  constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(bytes.size() * 4 / 3 + 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    unsigned group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kAlphabet[group >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

std::string figure(const ReportImage& image) {
  if (image.image.empty()) return "";
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", image.image, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return fmt::format(
      "<figure><img alt=\"{0}\" width=\"{1}\" height=\"{2}\" src=\"data:image/jpeg;base64,{3}\">"
      "<figcaption>{0}</figcaption></figure>\n",
      e(image.caption), image.image.cols, image.image.rows, base64(jpeg));
}

/// A chart as wide as the page, which on a narrow screen is scrolled rather than shrunk.
std::string wide(const std::string& chart) {
  return chart.empty() ? "" : "<div class=\"scroll\">" + chart + "</div>\n";
}

/// A card with a heading; empty text where there is nothing to put in.
std::string section(const std::string& heading, const std::string& content,
                    const std::string& note = "") {
  if (content.empty()) return "";
  return fmt::format("<section><h2>{}</h2>\n{}{}</section>\n", heading,
                     note.empty() ? "" : "<p class=\"note\">" + note + "</p>\n", content);
}

struct Tile {
  std::string name, value, unit, detail;
  std::string css_class = {};
};

std::string tile_html(const Tile& tile) {
  return fmt::format(
      "<div class=\"tile {}\"><div class=\"name\">{}</div><div class=\"value\">{}"
      "<span class=\"unit\">{}</span></div><div class=\"detail\">{}</div></div>\n",
      tile.css_class, tile.name, tile.value, tile.unit, tile.detail);
}

void add_error_tiles(const ReportData& data, std::vector<Tile>& tiles) {
  if (!data.evaluation) return;
  const Statistics& ate = data.evaluation->ate.translation;
  const RpeResult& rpe = data.evaluation->rpe;
  tiles.push_back({"Absolute error, RMSE", fmt::format("{:.1f}", 1000 * ate.rmse), "mm",
                   fmt::format("SD {:.1f}, max {:.1f} mm", 1000 * ate.sd, 1000 * ate.max)});
  if (rpe.pairs.empty()) return;
  tiles.push_back({"Drift per second, RMSE", fmt::format("{:.1f}", 1000 * rpe.translation.rmse),
                   "mm", fmt::format("{:.3f}\u00b0 rotation", rpe.rotation.rmse)});
}

void add_coverage_tile(const ReportData& data, std::vector<Tile>& tiles) {
  if (data.coverage.total == 0) return;
  const double share = data.coverage.share();
  tiles.push_back(
      {"Coverage", fmt::format("{:.1f}", 100 * share), "%",
       fmt::format("{} of {} frames tracked", data.coverage.tracked, data.coverage.total),
       data.coverage.tracked >= data.coverage.total ? "good"
       : share < 0.95                               ? "bad"
                                                    : ""});
}

void add_speed_tiles(const ReportData& data, std::vector<Tile>& tiles) {
  if (data.tracking_median) {
    tiles.push_back({"Tracking, median", fmt::format("{:.1f}", *data.tracking_median), "ms",
                     "per frame, critical path"});
  }
  if (data.frames_per_second) {
    tiles.push_back({"Speed", fmt::format("{:.1f}", *data.frames_per_second), "fps",
                     "whole run, everything on"});
  }
}

std::string tiles(const ReportData& data) {
  std::vector<Tile> tiles;
  add_error_tiles(data, tiles);
  add_coverage_tile(data, tiles);
  add_speed_tiles(data, tiles);
  if (data.keyframes > 0) {
    tiles.push_back(
        {"Map", grouped(data.keyframes), "keyframes", grouped(data.landmarks) + " landmarks"});
  }
  if (data.cloud_points > 0) {
    tiles.push_back({"Static cloud", rounded(data.cloud_points), "points",
                     grouped(data.cloud_points) + " in all"});
  }
  std::string html;
  for (const Tile& tile : tiles) html += tile_html(tile);
  return html.empty() ? "" : "<div class=\"tiles\">\n" + html + "</div>\n";
}

std::string chip(std::string_view name, std::string_view value) {
  if (value.empty()) return "";
  return fmt::format("<span class=\"chip\">{} <b>{}</b></span>", name, e(value));
}

std::string header(const ReportData& data) {
  return fmt::format(
      "<header><h1>{}</h1>\n<div class=\"subtitle\">{}</div>\n<div class=\"chips\">{}{}{}{}"
      "</div></header>\n",
      e(data.title), e(data.sequence), chip("preset", data.preset), chip("schedule", data.schedule),
      chip("on", data.hardware), chip("version", data.version));
}

std::string trajectory_legend(const ReportData& data) {
  std::string html = "<div class=\"legend\">";
  if (data.evaluation && data.truth) {
    html += "<span><i style=\"color:var(--truth)\"></i>truth</span>";
    html += "<span>estimate, colored by its error in mm</span><div class=\"colorbar\">" +
            error_color_bar(data) + "</div>";
  } else {
    html += "<span><i style=\"color:var(--accent)\"></i>estimate</span>";
  }
  return html +
         "<span><i class=\"dot\"></i>start</span><span><i class=\"square\"></i>end</span></div>\n";
}

std::string trajectory_section(const ReportData& data) {
  const std::string above = trajectory_chart(data, true);
  if (above.empty()) return "";
  return section("Trajectory", "<div class=\"pair\"><div><h3>from above</h3>" + above +
                                   "</div><div><h3>from the side</h3>" +
                                   trajectory_chart(data, false) + "</div></div>\n" +
                                   trajectory_legend(data));
}

std::string statistics_row(const std::string& name, const Statistics& s) {
  const auto cell = [](double value) { return fmt::format("{:.4f}", value); };
  std::string row = "<tr><td>" + name + "</td><td><b>" + cell(s.rmse) + "</b></td>";
  for (const double value : {s.mean, s.median, s.sd, s.min, s.max}) {
    row += "<td>" + cell(value) + "</td>";
  }
  return row + fmt::format("<td>{}</td></tr>\n", s.count);
}

std::string error_table(const ReportData& data) {
  if (!data.evaluation) return "";
  const Evaluation& evaluation = *data.evaluation;
  std::string html =
      "<div "
      "class=\"scroll\"><table><tr><th></th><th>RMSE</th><th>mean</th><th>median</th><th>SD</th>"
      "<th>min</th><th>max</th><th>pairs</th></tr>\n";
  html += statistics_row("ATE [m]", evaluation.ate.translation);
  if (!evaluation.rpe.pairs.empty()) {
    html += statistics_row("RPE over 1 s [m]", evaluation.rpe.translation);
    html += statistics_row("RPE over 1 s [\u00b0]", evaluation.rpe.rotation);
  }
  if (evaluation.rpe_frame) {
    html += statistics_row("RPE per frame [m]", evaluation.rpe_frame->translation);
    html += statistics_row("RPE per frame [\u00b0]", evaluation.rpe_frame->rotation);
  }
  return html + "</table></div>\n";
}

std::string error_section(const ReportData& data) {
  if (!data.evaluation) return "";
  return section("Error over time", wide(error_chart(data)) + error_table(data),
                 "By the TUM benchmark\u2019s rules: rigid alignment without scale, stamps paired "
                 "within 20 ms.");
}

std::string coverage_section(const ReportData& data) {
  return section(
      "Coverage",
      wide(coverage_strip(data)) +
          (data.frame_stamps.size() < 2
               ? ""
               : "<div class=\"legend\"><span><i class=\"block\" "
                 "style=\"background:var(--good)\"></i>"
                 "tracked</span><span><i class=\"block\" "
                 "style=\"background:var(--bad)\"></i>lost</span>"
                 "<span><i style=\"color:var(--warn);border-top-style:dotted\"></i>event (rest the "
                 "pointer "
                 "on it)</span></div>\n"));
}

std::string timing_section(const ReportData& data) {
  return section("Time per stage", wide(timing_chart(data)),
                 "Full bar and first figure: median; pale bar and second figure: 95th percentile. "
                 "Stages run in parallel, so they do not add up.");
}

std::string gallery(const std::vector<ReportImage>& images) {
  std::string html;
  for (const ReportImage& image : images) html += figure(image);
  return html.empty() ? "" : "<div class=\"gallery\">\n" + html + "</div>\n";
}

std::string table(const std::vector<std::string>& heads,
                  const std::vector<std::vector<std::string>>& rows) {
  if (rows.empty()) return "";
  std::string html = "<div class=\"scroll\"><table>";
  if (!heads.empty()) html += "<tr>";
  for (const std::string& head : heads) html += "<th class=\"text\">" + head + "</th>";
  if (!heads.empty()) html += "</tr>\n";
  for (const auto& row : rows) {
    html += "<tr>";
    for (const std::string& cell : row) html += "<td class=\"text\">" + e(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string facts_section(const std::string& heading, const std::vector<ReportFact>& facts,
                          const std::vector<std::string>& heads) {
  std::vector<std::vector<std::string>> rows;
  for (const ReportFact& fact : facts) rows.push_back({fact.name, fact.value});
  return section(heading, table(heads, rows));
}

std::string events_section(const ReportData& data) {
  const double start = data.frame_stamps.empty() ? 0 : data.frame_stamps.front();
  std::vector<std::vector<std::string>> rows;
  for (const ReportEvent& event : data.events) {
    if (rows.size() == kListed) {
      rows.push_back({"", fmt::format("and {} more", data.events.size() - kListed)});
      break;
    }
    rows.push_back({fmt::format("{:.2f} s", event.timestamp - start), event.text});
  }
  return section("Events", table({"time", "what happened"}, rows));
}

/// Skipped frames by reason, so that a thousand alike do not fill the page.
std::string skipped_section(const ReportData& data) {
  std::map<std::string, std::vector<double>> by_reason;
  for (const SkippedFrame& skipped : data.skipped)
    by_reason[skipped.reason].push_back(skipped.timestamp);
  std::vector<std::vector<std::string>> rows;
  for (const auto& [reason, stamps] : by_reason) {
    if (rows.size() == kListed) {
      rows.push_back({"", fmt::format("and {} more reasons", by_reason.size() - kListed), ""});
      break;
    }
    rows.push_back({std::to_string(stamps.size()), reason, fmt::format("{:.6f}", stamps.front())});
  }
  return section(fmt::format("Skipped frames: {}", data.skipped.size()),
                 table({"frames", "reason", "first at [s]"}, rows));
}

std::string movers_section(const ReportData& data) {
  const double start = data.frame_stamps.empty() ? 0 : data.frame_stamps.front();
  std::vector<std::vector<std::string>> rows;
  for (const ReportMover& m : data.movers) {
    if (rows.size() == 3 * kListed) {
      rows.push_back({"", fmt::format("and {} more", data.movers.size() - 3 * kListed)});
      break;
    }
    rows.push_back({std::to_string(m.id), m.class_name,
                    fmt::format("{:.2f} to {:.2f} s", m.first_seen - start, m.last_seen - start),
                    fmt::format("{} seen, {} hidden", m.seen, m.hidden),
                    fmt::format("{:.2f} m", m.length), fmt::format("{:.2f} m/s", m.mean_speed)});
  }
  if (rows.empty()) return "";
  return section(fmt::format("What moved: {}", data.movers.size()),
                 (data.movers_picture ? figure(*data.movers_picture) : "") +
                     table({"id", "class", "seen", "frames", "way", "mean speed"}, rows));
}

std::string options_section(const ReportData& data) {
  if (data.options.empty()) return "";
  return "<section><details><summary>Options in force</summary>\n<pre>" + e(data.options) +
         "</pre></details></section>\n";
}

std::string body(const ReportData& data) {
  return header(data) + tiles(data) + trajectory_section(data) + error_section(data) +
         coverage_section(data) + (data.cloud ? section("Static map", figure(*data.cloud)) : "") +
         movers_section(data) + section("Frames", gallery(data.gallery)) +
         section("Figures", gallery(data.figures)) + timing_section(data) +
         facts_section("Summary", data.facts, {}) + events_section(data) + skipped_section(data) +
         facts_section("Files", data.files, {}) + options_section(data);
}

}  // namespace

std::string report_html(const ReportData& data) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}"
      "<footer>Made by Stillmap. Errors never without coverage: lost frames have no "
      "error.</footer>\n"
      "</main>\n</body>\n</html>\n",
      e(data.sequence.empty() ? data.title : data.title + ": " + data.sequence), kReportStyle,
      body(data));
}

void write_report(const std::filesystem::path& file, const ReportData& data) {
  write_file(file, report_html(data));
}

}  // namespace stillmap
