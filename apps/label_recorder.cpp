// SPDX-License-Identifier: Apache-2.0
#include "label_recorder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/pipeline/draw_frame.hpp"
#include "stillmap/pipeline/labeled_frame.hpp"

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {

LabelRecorder::LabelRecorder(const LabelRecording& wanted, std::filesystem::path out)
    : wanted_(wanted), out_(std::move(out)) {
  if (wanted_.draw_every < 0) {
    throw Error("must be 1 or more", "--draw-verdicts",
                "name how many frames lie between pictures");
  }
  if (wanted_.draw_every > 0) make_output_folder(out_ / "verdicts");
}

void LabelRecorder::look(const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  if (wanted_.save) file_.add(labeled_frame(frame));
  if (wanted_.draw_every == 0 || frame.index() % static_cast<std::size_t>(wanted_.draw_every) != 0)
    return;
  const auto file = out_ / "verdicts" / fmt::format("{:06}.png", frame.index());
  if (!cv::imwrite(file.string(), draw_labels(tracked))) {
    throw Error("cannot be written", file.string(), "check the folder and the disk");
  }
}

std::vector<std::filesystem::path> LabelRecorder::finish() const {
  std::vector<std::filesystem::path> written;
  if (wanted_.save) {
    write_file(out_ / "verdicts.bin", file_.bytes());
    written.push_back(out_ / "verdicts.bin");
  }
  if (wanted_.draw_every > 0) written.push_back(out_ / "verdicts");
  return written;
}

}  // namespace stillmap
