// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/frame_source.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// An image for the page, or the reason why there is none.
struct ViewedImage {
  std::string jpeg;     ///< JPEG file; empty if there is a problem.
  std::string problem;  ///< One sentence for the user; empty if there is no problem.
};

/// The camera images of a finished run. They are read from its recording on request.
/// May be used by any thread.
class RunImages {
 public:
  /// @param recording  path of the recording, or name of the live camera; empty: not known
  explicit RunImages(std::string recording);

  /// Returns why there are no images; empty if there are.
  const std::string& problem() const { return problem_; }

  /// Returns the image nearest to a time [s], reduced to a width of at most 640 pixels. Images of a
  /// folder are those of the files; images of a recorded file are rectified.
  ViewedImage at(double timestamp);

 private:
  cv::Mat in_folder(double timestamp) const;
  cv::Mat in_file(double timestamp);

  const std::string recording_;
  std::string problem_;
  std::vector<FrameFiles> files_;  // of a folder of images
  std::mutex mutex_;
  // Of a recorded file, under the mutex: it is read forwards, and opened again to go back.
  std::unique_ptr<FrameSource> source_;  // null before the first image
  RgbdFramePtr before_, after_;          // the last two frames that were read
};

}  // namespace stillmap
