// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/label_recorder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/report/frame_image.hpp"
#include "stillmap/report/labeled_frame.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <fmt/format.h>

namespace stillmap {

LabelRecorder::LabelRecorder(const LabelRecording& wanted, ResultFolder& folder)
    : wanted_(wanted), folder_(folder) {
  if (wanted_.draw_every < 0)
    throw Error(fmt::format("the interval of the drawn frames is {}", wanted_.draw_every),
                "motion labels", "give a number of frames of 1 or more");
}

void LabelRecorder::on_frame(SlamSystem& slam) {
  const TrackedFrame& tracked = *slam.newest();
  const Frame& frame = *tracked.frame;
  if (wanted_.save) file_.add(labeled_frame(frame));
  if (wanted_.draw_every == 0 || frame.index() % static_cast<std::size_t>(wanted_.draw_every) != 0)
    return;
  folder_.write_drawing(fmt::format("{}/{:06}.png", wanted_.name, frame.index()),
                        [&](const auto& file) { write_png(file, draw_labels(tracked)); });
}

void LabelRecorder::on_results(RunRecord& /*record*/) {
  if (wanted_.save) folder_.write_text(wanted_.file(), file_.bytes());
}

}  // namespace stillmap
