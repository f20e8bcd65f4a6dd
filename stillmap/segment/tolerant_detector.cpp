// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/tolerant_detector.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/warning.hpp"

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Throws Error for a box that is not within the image, and for a mask that does not fit its box.
void require_usable(const Instance& instance, cv::Size image) {
  constexpr const char* kWhere = "Detector::detect";
  const cv::Rect& box = instance.box;
  if ((box & cv::Rect({}, image)) != box) {
    throw Error(fmt::format("the box of a '{}' is {} x {} pixels at ({}, {}), not within the image "
                            "of {} x {}",
                            instance.class_name, box.width, box.height, box.x, box.y, image.width,
                            image.height),
                kWhere, "give boxes in pixels of the full image, clipped to it");
  }
  const cv::Mat& mask = instance.mask;
  if (mask.empty() || (mask.size() == box.size() && mask.type() == CV_8UC1)) return;
  throw Error(fmt::format("the mask of a '{}' is {} x {} of type {}, and its box {} x {} pixels",
                          instance.class_name, mask.cols, mask.rows, cv::typeToString(mask.type()),
                          box.width, box.height),
              kWhere, "give masks of type CV_8UC1 in the size of their boxes");
}

}  // namespace

std::vector<Instance> TolerantDetector::detect(const RgbdFrame& frame) {
  ++frames_;
  try {
    std::vector<Instance> instances = detector_->detect(frame);
    for (const Instance& instance : instances) require_usable(instance, frame.gray.size());
    return instances;
  } catch (const Error& error) {
    count(error, frame.index);
  } catch (const std::exception& error) {
    count({error.what(), detector_->description(), "correct the detector, or use another one"},
          frame.index);
  }
  return {};
}

void TolerantDetector::count(const Error& failure, std::size_t frame) {
  if (failed_++ > 0) return;
  const std::string& where = failure.where();
  first_failure_ = (where.empty() ? "" : where + ": ") + failure.problem();
  warn(fmt::format("the detector failed in frame {}, which therefore has no objects ({}); further "
                   "failures are only counted",
                   frame, first_failure_),
       failure.fix());
}

std::string TolerantDetector::skipped() const {
  std::string skipped = detector_->skipped();
  if (failed_ == 0) return skipped;
  return fmt::format("{}{}the detector failed in {} of {}; the first: {}", skipped,
                     skipped.empty() ? "" : "; ", failed_, counted(frames_, "frame"),
                     first_failure_);
}

}  // namespace stillmap
