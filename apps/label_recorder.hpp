// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/motion_labels.hpp"
#include "stillmap/track/tracker.hpp"

#include <filesystem>
#include <vector>

namespace stillmap {

/// What is to be kept of the labels on motion.
struct LabelRecording {
  bool save = false;   ///< verdicts.bin: every keypoint of every frame, about 10 kB a frame
  int draw_every = 0;  ///< labels/FRAME.png of every so-manieth frame; 0: none
};

/// Keeps the labels of a run and writes them into its folder.
class LabelRecorder {
 public:
  /// Throws Error if the folder for the pictures cannot be made.
  LabelRecorder(const LabelRecording& wanted, std::filesystem::path out);
  /// Draws the frame if it is one of those to be drawn. Throws Error if that cannot be written.
  void look(const TrackedFrame& tracked);
  /// Writes the file, if wanted; what was written. Throws Error.
  std::vector<std::filesystem::path> finish() const;

 private:
  LabelRecording wanted_;
  std::filesystem::path out_;
  LabelFile file_;
};

}  // namespace stillmap
