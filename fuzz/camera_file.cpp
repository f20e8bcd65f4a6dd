// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_file.hpp"

#include "stillmap/sensor/make_source.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  Camera camera = read_camera("tum_fr1");
  camera.shutter = {.readout = 0.02, .depth_delay = 0.01};
  camera.disparity_bias = {.offset = 0.001, .bow = 0.001};
  const auto own = file_with("", "own.yaml");
  write_camera(own, camera);
  return {content_of(own),
          // camera_info of ROS
          R"(image_width: 64
image_height: 48
distortion_model: plumb_bob
camera_matrix:
  data: [60, 0, 31.5, 0, 60, 23.5, 0, 0, 1]
distortion_coefficients:
  data: [0.1, 0, 0, 0, 0]
projection_matrix:
  data: [60, 0, 31.5, 0, 0, 60, 23.5, 0, 0, 0, 1, 0]
)",
          // camera_info of ROS, printed
          R"(header:
  frame_id: color
height: 48
width: 64
distortion_model: plumb_bob
d:
- 0.1
- 0.0
k: [60.0, 0.0, 31.5, 0.0, 60.0, 23.5, 0.0, 0.0, 1.0]
---
)",
          // Open3D
          R"({"width": 64, "height": 48, "intrinsic_matrix": [60, 0, 0, 0, 60, 0, 31.5, 23.5, 1],
              "depth_scale": 1000})",
          // librealsense
          R"({"width": 64, "height": 48, "fx": 60, "fy": 60, "ppx": 31.5, "ppy": 23.5,
              "model": "brown_conrady", "coeffs": [0, 0, 0, 0, 0], "depth_units": 0.001})",
          // OpenCV, XML
          R"(<?xml version="1.0"?>
<opencv_storage>
<image_width>64</image_width><image_height>48</image_height>
<!-- --><camera_matrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
<data>60 0 31.5 0 60 23.5 0 0 1</data></camera_matrix>
<images><_>1.png</_><_/></images>
</opencv_storage>
)",
          // NICE-SLAM
          R"(cam:
  H: 48
  W: 64
  fx: 60
  fy: 60
  cx: 31.5
  cy: 23.5
  png_depth_scale: 1000
  distortion: [0.1, 0]
)",
          // ORB-SLAM
          R"(%YAML:1.0
Camera.type: "PinHole"
Camera.fx: 60
Camera.fy: 60
Camera.cx: 31.5
Camera.cy: 23.5
Camera.k1: 0.1
Camera.width: 64
Camera.height: 48
Camera.fps: 30.0
Camera.bf: 4.5
DepthMapFactor: 5000.0
)"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] {
    const Camera camera = read_camera(file.string());
    const auto copy = fuzz::file_with("", "copy.yaml");
    write_camera(copy, camera);
    if (read_camera(copy.string()).fx != camera.fx) std::abort();
  });
  return 0;
}
