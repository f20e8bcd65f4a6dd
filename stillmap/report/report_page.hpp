// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/captioned_image.hpp"
#include "stillmap/report/run_record.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Images that the report page shows in addition to the record's gallery.
struct ReportImages {
  std::optional<CaptionedImage> cloud;   ///< The static cloud.
  std::optional<CaptionedImage> movers;  ///< Paths of the movers from above.
  /// Further images of the dense map, first the one of all measurements beside the static cloud.
  std::vector<CaptionedImage> more;
  std::vector<std::string> files;  ///< Files to link to, by their paths relative to the page.
};

/// Returns the report as one self-contained HTML page: inline CSS and SVG, images as base64 JPEG,
/// no scripts, no external resources. It follows the reader's light or dark setting and prints on
/// A4. All text from the data is escaped. Parts without data are omitted.
std::string report_html(const RunRecord& record, const ReportImages& images = {});

}  // namespace stillmap
