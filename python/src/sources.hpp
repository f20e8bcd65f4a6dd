// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <memory>

namespace stillmap::python {

/// A frame of a source, for stillmap.Frame.
struct Frame {
  RgbdFramePtr data;                     ///< Never null.
  std::shared_ptr<const Camera> camera;  ///< Of the source; never null.
};

}  // namespace stillmap::python
