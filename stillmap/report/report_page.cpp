// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/report_page.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/report/html_page.hpp"
#include "stillmap/report/mover_files.hpp"
#include "stillmap/report/report_charts.hpp"
#include "stillmap/report/svg.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr std::size_t kListed = 12;  // rows of a list before the rest is only counted
constexpr std::size_t kListedMovers = 36;

std::string e(std::string_view text) { return escape_markup(text); }

/// Returns a number in groups of three digits, with thin spaces between them: 18 204.
std::string grouped(std::size_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += "\u202f";
    text += digits[i];
  }
  return text;
}

/// Returns a number with three digits: 950, 18.2 k, 1.23 M.
std::string rounded(std::size_t number) {
  const auto value = static_cast<double>(number);
  if (number < 1000) return std::to_string(number);
  return number < 999500 ? fmt::format("{:.3g}\u2009k", value / 1e3)
                         : fmt::format("{:.3g}\u2009M", value / 1e6);
}

/// Returns the relative address of a file (RFC 3986).
std::string link_to(const std::string& file) {
  std::string link;
  for (const char c : file) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        std::isalnum(byte) != 0 || std::string_view("-._~/").find(c) != std::string_view::npos;
    link += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return link;
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

void add_error_tiles(const RunRecord& record, std::vector<Tile>& tiles) {
  if (!record.evaluation) return;
  const Statistics& ate = record.evaluation->ate.translation;
  const RpeResult& rpe = record.evaluation->rpe;
  tiles.push_back({"Absolute error, RMSE", fmt::format("{:.1f}", 1000 * ate.rmse), "mm",
                   fmt::format("SD {:.1f}, max {:.1f} mm", 1000 * ate.sd, 1000 * ate.max)});
  if (rpe.pairs.empty()) return;
  tiles.push_back({"Drift per second, RMSE", fmt::format("{:.1f}", 1000 * rpe.translation.rmse),
                   "mm", fmt::format("{:.3f}\u00b0 rotation", rpe.rotation.rmse)});
}

void add_coverage_tile(const RunRecord& record, std::vector<Tile>& tiles) {
  const Coverage coverage = compute_coverage(record.result.trajectory, record.total_frames());
  if (coverage.total == 0) return;
  const double share = coverage.share();
  const std::size_t late = record.late_frames().size();
  tiles.push_back(
      {"Coverage", fmt::format("{:.1f}", 100 * share), "%",
       fmt::format("{} of {} tracked{}", coverage.tracked, counted(coverage.total, "frame"),
                   late > 0 ? fmt::format(", {} dropped late", late) : ""),
       coverage.tracked >= coverage.total ? "good"
       : share < 0.95                     ? "bad"
                                          : ""});
}

void add_speed_tiles(const RunRecord& record, std::vector<Tile>& tiles) {
  if (const double median = record.tracking_median(); median > 0) {
    tiles.push_back(
        {"Tracking, median", fmt::format("{:.1f}", median), "ms", "per frame, critical path"});
  }
  if (const double fps = record.frames_per_second(); fps > 0)
    tiles.push_back({"Speed", fmt::format("{:.1f}", fps), "fps", "whole run, all outputs"});
}

std::string tiles(const RunRecord& record) {
  const SlamResult& result = record.result;
  std::vector<Tile> tiles;
  add_error_tiles(record, tiles);
  add_coverage_tile(record, tiles);
  add_speed_tiles(record, tiles);
  if (!result.keyframes.empty()) {
    const std::size_t count = result.keyframes.size();
    tiles.push_back({"Map", grouped(count), count == 1 ? "keyframe" : "keyframes",
                     grouped(result.landmarks) + " landmarks"});
  }
  if (const std::size_t points = result.dense.cloud.size(); points > 0)
    tiles.push_back({"Static cloud", rounded(points), "points", grouped(points) + " in total"});
  std::string html;
  for (const Tile& tile : tiles) html += tile_html(tile);
  return html.empty() ? "" : "<div class=\"tiles\">\n" + html + "</div>\n";
}

std::string chip(std::string_view name, std::string_view value) {
  if (value.empty()) return "";
  return fmt::format("<span class=\"chip\">{} <b>{}</b></span>", name, e(value));
}

std::string header(const RunRecord& record) {
  return fmt::format("<header><h1>{}</h1>\n<div class=\"chips\">{}{}{}{}{}</div></header>\n",
                     e(record.sequence.empty() ? "Stillmap" : record.sequence),
                     chip("preset", record.options.preset()),
                     chip("schedule", record.options.schedule.mode),
                     chip("ended", record.interrupted ? "early: interrupted or killed" : ""),
                     chip("machine", record.machine), chip("version", STILLMAP_VERSION));
}

std::string trajectory_legend(const RunRecord& record) {
  std::string html = "<div class=\"legend\">";
  if (record.evaluation && record.truth) {
    html += "<span><i style=\"color:var(--truth)\"></i>ground truth</span>";
    html += "<span>estimate, colored by its error in mm</span><div class=\"colorbar\">" +
            error_color_bar(record) + "</div>";
  } else {
    html += "<span><i style=\"color:var(--accent)\"></i>estimate</span>";
  }
  return html +
         "<span><i class=\"dot\"></i>start</span><span><i class=\"square\"></i>end</span></div>\n";
}

std::string trajectory_section(const RunRecord& record) {
  const std::string above = trajectory_chart(record, PathView::kFromAbove);
  if (above.empty()) return "";
  return html_card("Trajectory", "<div class=\"pair\"><div><h3>from above</h3>" + above +
                                     "</div><div><h3>from the side</h3>" +
                                     trajectory_chart(record, PathView::kFromTheSide) +
                                     "</div></div>\n" + trajectory_legend(record));
}

std::string statistics_row(const std::string& name, const Statistics& s) {
  const auto cell = [](double value) { return fmt::format("{:.4f}", value); };
  std::string row = "<tr><td>" + name + "</td><td><b>" + cell(s.rmse) + "</b></td>";
  for (const double value : {s.mean, s.median, s.sd, s.min, s.max}) {
    row += "<td>" + cell(value) + "</td>";
  }
  return row + fmt::format("<td>{}</td></tr>\n", s.count);
}

std::string error_table(const RunRecord& record) {
  if (!record.evaluation) return "";
  const Evaluation& evaluation = *record.evaluation;
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
  if (evaluation.displacement.error.count > 0) {
    html += statistics_row("displacement error per frame [m]", evaluation.displacement.error);
    html +=
        statistics_row("estimated displacement per frame [m]", evaluation.displacement.estimate);
  }
  return html + "</table></div>\n";
}

std::string error_section(const RunRecord& record) {
  if (!record.evaluation) return "";
  return html_card(
      "Error over time", wide_chart(error_chart(record)) + error_table(record),
      "As in the TUM RGB-D benchmark: rigid alignment without scale, time stamps matched "
      "within 20 ms.");
}

std::string coverage_legend(const RunRecord& record) {
  if (record.result.frames.size() < 2) return "";
  const auto block = [](const char* color, const char* name) {
    return fmt::format("<span><i class=\"block\" style=\"background:var(--{})\"></i>{}</span>",
                       color, name);
  };
  return "<div class=\"legend\">" + block("good", "tracked") + block("bad", "lost") +
         (record.late_frames().empty() ? "" : block("late", "dropped late")) +
         "<span><i style=\"color:var(--warn);border-top-style:dotted\"></i>event (hover for "
         "details)</span></div>\n";
}

std::string coverage_section(const RunRecord& record) {
  return html_card("Coverage", wide_chart(coverage_strip(record)) + coverage_legend(record));
}

std::string timing_section(const RunRecord& record) {
  return html_card(
      "Time per stage", wide_chart(timing_chart(record)),
      "Solid bar and first number: median; light bar and second number: 95th percentile; "
      "logarithmic scale. Stages run in parallel, so the times do not add up.");
}

std::string gallery(const std::vector<CaptionedImage>& images) {
  std::string html;
  for (const CaptionedImage& image : images) html += html_figure(image);
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

std::string summary_section(const RunRecord& record) {
  const SlamResult& result = record.result;
  const auto or_none = [](const std::string& text) { return text.empty() ? "none" : text; };
  std::vector<std::vector<std::string>> rows{
      {"detector", or_none(record.detector)},
      {"frames segmented", std::to_string(result.segmented)},
      {"frames skipped", std::to_string(record.frames_skipped())},
      {"depth images skipped", std::to_string(record.skipped.size() - record.frames_skipped())},
      {"frames dropped late", std::to_string(record.late_frames().size())},
      {"frames with fewer keypoints",
       std::to_string(result.load_shedding.frames_of_fewer_keypoints)},
      {"maps", std::to_string(result.maps)},
      {"loops and losses", or_none(map_events_text(result))},
      {"peak memory", fmt::format("{:.0f} MiB", record.peak_memory_mib)}};
  if (!result.detector_skipped.empty()) rows.push_back({"masks", result.detector_skipped});
  return html_card("Summary", table({}, rows));
}

/// Returns the meaning of the colors in the example frames: see draw_frame().
std::string frame_legend() {
  return "<div class=\"legend\">"
         "<span><i class=\"ring\" style=\"border-color:#46dc5a\"></i>keypoint of a landmark</span>"
         "<span><i class=\"ring small\" style=\"border-color:#f0d23c\"></i>other keypoint</span>"
         "<span><b style=\"color:#eb3c3c\">\u00d7</b>moving keypoint, not used for the pose</span>"
         "<span><i class=\"block\" style=\"background:#eb3c3c88\"></i>moving surface</span>"
         "<span><i class=\"outline\"></i>detected object</span></div>\n";
}

std::string frames_section(const RunRecord& record) {
  const std::string images = gallery(record.gallery);
  return images.empty() ? "" : html_card("Example frames", images + frame_legend());
}

/// Returns the card of the dense map: the cloud, and in the same size the first of the other
/// images, which compares it with all measurements.
std::string map_section(const ReportImages& images) {
  if (!images.cloud) return "";
  const std::vector<CaptionedImage>& more = images.more;
  std::string html = html_figure(*images.cloud);
  if (!more.empty()) html += html_figure(more.front()) + gallery({more.begin() + 1, more.end()});
  return html_card("Static map", html);
}

/// Returns links to the written files, relative to the page.
std::string files_section(const std::vector<std::string>& files) {
  std::string html;
  for (const std::string& file : files)
    html += fmt::format("<a class=\"chip\" href=\"{0}\">{1}</a>\n", link_to(file), e(file));
  return html_card("Files", html.empty() ? "" : "<div class=\"chips\">\n" + html + "</div>\n");
}

double start_of(const RunRecord& record) {
  return record.result.frames.empty() ? 0 : record.result.frames.front().timestamp;
}

/// Returns a card with the first events of a list.
std::string events_card(const std::string& title, const RunRecord& record,
                        const std::vector<RunEvent>& events) {
  std::vector<std::vector<std::string>> rows;
  for (const RunEvent& event : events) {
    if (rows.size() == kListed) {
      rows.push_back({"", fmt::format("and {} more", events.size() - kListed)});
      break;
    }
    rows.push_back({fmt::format("{:.2f} s", event.timestamp - start_of(record)), event.text});
  }
  return html_card(title, table({"time", "event"}, rows));
}

/// Returns the list of skipped frames, grouped by reason.
std::string skipped_section(const RunRecord& record) {
  std::map<std::string, std::vector<double>> by_reason;
  for (const SkippedFrame& skipped : record.skipped)
    by_reason[skipped.reason].push_back(skipped.timestamp);
  std::vector<std::vector<std::string>> rows;
  for (const auto& [reason, stamps] : by_reason) {
    if (rows.size() == kListed) {
      rows.push_back({"", fmt::format("and {} more reasons", by_reason.size() - kListed), ""});
      break;
    }
    rows.push_back({std::to_string(stamps.size()), reason, fmt::format("{:.6f}", stamps.front())});
  }
  return html_card(fmt::format("Skipped images and lines: {}", record.skipped.size()),
                   table({"count", "reason", "first at [s]"}, rows));
}

std::string movers_section(const RunRecord& record, const ReportImages& images) {
  const std::vector<MoverTrack>& movers = record.result.movers;
  std::vector<std::vector<std::string>> rows;
  for (const MoverTrack& track : movers) {
    if (rows.size() == kListedMovers) {
      rows.push_back({"", fmt::format("and {} more", movers.size() - kListedMovers)});
      break;
    }
    const MoverPath path = path_of(track);
    const double start = start_of(record);
    rows.push_back(
        {std::to_string(track.id), track.class_name,
         fmt::format("{:.2f} to {:.2f} s", track.first_seen - start, track.last_seen - start),
         fmt::format("{} observed, {} predicted", path.observed, path.predicted),
         fmt::format("{:.2f} m", path.length), fmt::format("{:.2f} m/s", path.mean_speed)});
  }
  if (rows.empty()) return "";
  return html_card(fmt::format("Moving objects: {}", movers.size()),
                   (images.movers ? html_figure(*images.movers) : "") +
                       table({"id", "class", "time", "frames", "path length", "mean speed"}, rows));
}

std::string options_section(const RunRecord& record) {
  return "<section><details><summary>Options in force</summary>\n<pre>" +
         e(options_yaml(record.options)) + "</pre></details></section>\n";
}

/// Returns the findings; those of an untrusted result in boxes.
std::string findings_section(const RunRecord& record) {
  std::string text;
  for (const Finding& finding : findings_with(Severity::kUntrusted, record.findings))
    text +=
        "<p class=\"untrusted\"><b>Do not trust this result:</b> " + e(finding.text()) + "</p>\n";
  for (const Finding& finding : findings_with(Severity::kNote, record.findings))
    text += "<p>Note: " + e(finding.text()) + "</p>\n";
  return text;
}

std::string body(const RunRecord& record, const ReportImages& images) {
  return header(record) + findings_section(record) + tiles(record) + trajectory_section(record) +
         error_section(record) + coverage_section(record) + map_section(images) +
         movers_section(record, images) +
         events_card(fmt::format("Warnings and changes: {}", record.warnings.size()), record,
                     record.warnings) +
         frames_section(record) + files_section(images.files) + timing_section(record) +
         summary_section(record) + events_card("Events", record, run_events(record.result)) +
         skipped_section(record) + options_section(record);
}

}  // namespace

std::string report_html(const RunRecord& record, const ReportImages& images) {
  return html_page(record.sequence.empty() ? "Stillmap" : "Stillmap: " + record.sequence,
                   body(record, images),
                   "Made by Stillmap. Error figures cover tracked frames only: compare them "
                   "together with the coverage.");
}

}  // namespace stillmap
