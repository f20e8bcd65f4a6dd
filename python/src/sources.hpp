// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap::python {

/// A frame of a source, for stillmap.Frame.
struct Frame {
  RgbdFramePtr data;  ///< Never null.
};

}  // namespace stillmap::python
