// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/motion_labels.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_sink.hpp"

namespace stillmap {

/// Which motion labels of a run are saved.
struct LabelRecording {
  bool save = false;   ///< Whether to save the label of every keypoint, about 10 kB per frame.
  int draw_every = 0;  ///< Draws every n-th frame with its labels; 0: none.
  /// Name of the file, without the extension .bin, and of the folder of the images.
  std::string name = "labels";
  std::string file() const { return name + ".bin"; }
};

/// Saves the motion labels of a run: labels.bin and labels/FRAME.png.
class LabelRecorder final : public RunSink {
 public:
  /// @param folder  must outlive this object
  /// Throws Error for a negative interval.
  LabelRecorder(const LabelRecording& wanted, ResultFolder& folder);
  /// Records one frame; draws it if it is one of those to be drawn.
  void on_frame(SlamSystem& slam) override;
  /// Writes labels.bin, if wanted.
  void on_results(RunRecord& record) override;

 private:
  LabelRecording wanted_;
  ResultFolder& folder_;
  LabelFile file_;
};

}  // namespace stillmap
