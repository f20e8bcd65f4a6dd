// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/rgbd_streams.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// Decodes a message with a color image to 8UC3 BGR, or returns the problem in words that follow
/// the name of the topic. Never throws.
/// @param encoding  of the message: "ros1" or "cdr"
ImageRead decode_recorded_color(const ImageStream& stream, const std::string& encoding,
                                ByteSpan message, cv::Size wanted);

/// Decodes a message with a depth image to 16UC1 [raw units] or 32FC1 [m]; otherwise as
/// decode_recorded_color().
ImageRead decode_recorded_depth(const ImageStream& stream, const std::string& encoding,
                                ByteSpan message, cv::Size wanted);

}  // namespace stillmap
