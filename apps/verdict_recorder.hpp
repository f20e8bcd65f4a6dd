// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/verdicts.hpp"
#include "stillmap/track/tracker.hpp"

#include <filesystem>
#include <vector>

namespace stillmap {

/// What is to be kept of the verdicts on motion.
struct VerdictRecording {
  bool save = false;   ///< verdicts.bin: every keypoint of every frame, about 10 kB a frame
  int draw_every = 0;  ///< verdicts/FRAME.png of every so-manieth frame; 0: none
};

/// Keeps the verdicts of a run and writes them into its folder.
class VerdictRecorder {
 public:
  /// Throws Error if the folder for the pictures cannot be made.
  VerdictRecorder(const VerdictRecording& wanted, std::filesystem::path out);
  /// Draws the frame if it is one of those to be drawn. Throws Error if that cannot be written.
  void look(const TrackedFrame& tracked);
  /// Writes the file, if wanted; what was written. Throws Error.
  std::vector<std::filesystem::path> finish() const;

 private:
  VerdictRecording wanted_;
  std::filesystem::path out_;
  VerdictFile file_;
};

}  // namespace stillmap
