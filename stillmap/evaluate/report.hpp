// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/timing.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Something worth a mark on the time line: "lost", "new map", "re-initialized", ...
struct ReportEvent {
  double timestamp = 0;  ///< seconds
  std::string text;
};

/// A picture with its caption. 8UC1 or 8UC3 BGR.
struct ReportImage {
  cv::Mat image;
  std::string caption;
};

/// A line of the summary's table: "landmarks", "18 204".
struct ReportFact {
  std::string name, value;
};

/// One thing that moved, as a line of the report's table.
struct ReportMover {
  int id = 0;
  std::string class_name;
  double first_seen = 0, last_seen = 0;  ///< seconds
  double length = 0;                     ///< of its way [m]
  double mean_speed = 0;                 ///< [m/s]
  std::size_t seen = 0, hidden = 0;      ///< frames
};

/// All that report.html shows. Whatever is empty is left out of the page.
struct ReportData {
  std::string title = "Stillmap";  ///< heading
  std::string sequence;            ///< folder or name
  std::string preset;
  std::string schedule;
  std::string hardware;  ///< "AMD EPYC, 2 cores"
  std::string version;
  std::string options;  ///< every option in force, as YAML or JSON text

  Trajectory trajectory;                ///< the estimate, every tracked frame
  std::vector<double> frame_stamps;     ///< of all frames handed in, tracked or not [s]
  std::vector<double> keyframe_stamps;  ///< [s]
  std::optional<Trajectory> truth;
  std::optional<Evaluation> evaluation;  ///< against the truth
  Coverage coverage;

  std::size_t keyframes = 0, landmarks = 0, cloud_points = 0;
  std::optional<double> frames_per_second;  ///< of the whole run
  std::optional<double> tracking_median;    ///< [ms]
  std::vector<ReportFact> facts;            ///< more lines for the summary

  std::vector<StageTiming> timing;
  std::vector<ReportEvent> events;
  std::vector<SkippedFrame> skipped;
  std::vector<ReportImage> gallery;  ///< frames with keypoints and masks drawn in
  std::optional<ReportImage> cloud;  ///< picture of the dense cloud
  std::vector<ReportMover> movers;
  std::optional<ReportImage> movers_picture;  ///< their ways from above
  std::vector<ReportImage> figures;           ///< more pictures: masks, ghosts
  std::vector<ReportFact> files;              ///< what was written: file name, what it is
};

/// The report as one self-contained HTML page: inline CSS and SVG, pictures as base64 JPEG, no
/// script and nothing loaded from elsewhere; follows the reader's light or dark setting and prints
/// on A4. Every text from the data is escaped.
std::string report_html(const ReportData& data);

/// report_html into a file. Throws Error if it cannot be written.
void write_report(const std::filesystem::path& file, const ReportData& data);

}  // namespace stillmap
