// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/realsense_camera.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/geometry/depth_sensor.hpp"

#ifdef STILLMAP_HAS_REALSENSE

#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/depth_registration.hpp"
#include "stillmap/sensor/lens.hpp"
#include "stillmap/sensor/rectified_frame.hpp"
#include "stillmap/sensor/rectifier.hpp"

#include <algorithm>
#include <filesystem>
#include <librealsense2/rs.hpp>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr const char* kWhere = "realsense:";

LensDistortion::Model model_of(rs2_distortion model) {
  switch (model) {
    case RS2_DISTORTION_NONE:
    case RS2_DISTORTION_BROWN_CONRADY:
    case RS2_DISTORTION_MODIFIED_BROWN_CONRADY:  // equal to first order
      return LensDistortion::Model::kBrown;
    case RS2_DISTORTION_INVERSE_BROWN_CONRADY:
      return LensDistortion::Model::kInverseBrown;
    case RS2_DISTORTION_KANNALA_BRANDT4:
      return LensDistortion::Model::kFisheye;
    default:
      throw Error(fmt::format("the lens has the model '{}'", rs2_distortion_to_string(model)),
                  kWhere, "choose a camera of the D400 series");
  }
}

RecordedCamera camera_of(const rs2::video_stream_profile& profile) {
  const rs2_intrinsics i = profile.get_intrinsics();
  RecordedCamera camera{.width = i.width,
                        .height = i.height,
                        .fx = i.fx,
                        .fy = i.fy,
                        .cx = i.ppx,
                        .cy = i.ppy,
                        .lens = {.model = model_of(i.model), .coefficients = {}}};
  std::vector<double> coefficients(std::begin(i.coeffs), std::end(i.coeffs));
  if (camera.lens.model == LensDistortion::Model::kFisheye) coefficients.resize(4);
  const bool distorted = std::any_of(coefficients.begin(), coefficients.end(),
                                     [](double coefficient) { return coefficient != 0; });
  if (distorted) camera.lens.coefficients = std::move(coefficients);
  return camera;
}

// Returns the transform as a pose; librealsense writes the rotation by columns.
Pose pose_of(const rs2_extrinsics& transform) {
  const Eigen::Matrix3f rotation = Eigen::Map<const Eigen::Matrix3f>(transform.rotation);
  const Eigen::Vector3f translation = Eigen::Map<const Eigen::Vector3f>(transform.translation);
  return {rotation.cast<double>(), translation.cast<double>()};
}

rs2::config config_of(const std::string& name) {
  rs2::config config;
  if (is_file(name)) {
    config.enable_device_from_file(name, /*repeat_playback=*/false);
    return config;
  }
  constexpr int kWidth = 640, kHeight = 480, kRate = 30;  // pixels, Hz
  if (!name.empty()) config.enable_device(name);
  config.enable_stream(RS2_STREAM_COLOR, kWidth, kHeight, RS2_FORMAT_BGR8, kRate);
  config.enable_stream(RS2_STREAM_DEPTH, kWidth, kHeight, RS2_FORMAT_Z16, kRate);
  return config;
}

class RealsenseCamera : public LiveCamera {
 public:
  RealsenseCamera(const std::string& name, const std::string& ignore)
      : profile_(pipeline_.start(config_of(name))),
        color_(profile_.get_stream(RS2_STREAM_COLOR).as<rs2::video_stream_profile>()),
        depth_(profile_.get_stream(RS2_STREAM_DEPTH).as<rs2::video_stream_profile>()),
        recorded_(recorded_camera(ignore)),
        rectifier_(recorded_, camera_of(color_).lens),
        registration_(camera_of(depth_), pose_of(depth_.get_extrinsics_to(color_)), camera()) {}

  const Camera& camera() const override { return rectifier_.camera(); }

  std::shared_ptr<RgbdFrame> read() override {
    constexpr unsigned kWait = 200;  // milliseconds
    try {
      rs2::frameset frames;
      if (!pipeline_.try_wait_for_frames(&frames, kWait)) return nullptr;
      const rs2::video_frame color = frames.get_color_frame();
      const rs2::depth_frame depth = frames.get_depth_frame();
      return color && depth ? frame_of(color, depth) : nullptr;
    } catch (const rs2::error& error) {
      throw Error(error.what(), kWhere, "plug the camera in again");
    }
  }

  std::vector<Finding> findings() const override { return rectifier_.findings(); }

  std::vector<std::string> notes() const override {
    std::vector<std::string> notes{fmt::format(
        "{}: color {} x {}, depth {} x {}, {} Hz, will be registered", recorded_.name,
        recorded_.width, recorded_.height, depth_.width(), depth_.height(), color_.fps())};
    if (!rectifier_.ignored_note().empty()) notes.push_back(rectifier_.ignored_note());
    return notes;
  }

 private:
  Camera recorded_camera(const std::string& ignore) const {
    if (color_.format() != RS2_FORMAT_BGR8 && color_.format() != RS2_FORMAT_RGB8) {
      throw Error(
          fmt::format("the color images have the format {}", rs2_format_to_string(color_.format())),
          kWhere, "give a recording with RGB8 or BGR8");
    }
    const rs2::device device = profile_.get_device();
    Camera camera = pinhole_of(camera_of(color_));
    const bool named = device.supports(RS2_CAMERA_INFO_NAME);
    camera.name = named ? device.get_info(RS2_CAMERA_INFO_NAME) : "RealSense";
    camera.fps = color_.fps();
    camera.depth_factor = 1 / device.first<rs2::depth_sensor>().get_depth_scale();
    camera.depth_sensor = find_depth_sensor(realsense_sensor_named(camera.name));
    camera.baseline = camera.depth_sensor.baseline;
    camera.ignore = ignore;
    check_camera(camera, kWhere);
    return camera;
  }

  std::shared_ptr<RgbdFrame> frame_of(const rs2::video_frame& color,
                                      const rs2::depth_frame& depth) const {
    constexpr double kMilliseconds = 1e-3;
    const cv::Mat recorded(color.get_height(), color.get_width(), CV_8UC3,
                           const_cast<void*>(color.get_data()),  // only read
                           color.get_stride_in_bytes());
    const cv::Mat raw(depth.get_height(), depth.get_width(), CV_16UC1,
                      const_cast<void*>(depth.get_data()), depth.get_stride_in_bytes());
    cv::Mat bgr;  // a copy: the frame of librealsense ends with this function
    if (color.get_profile().format() == RS2_FORMAT_RGB8) {
      cv::cvtColor(recorded, bgr, cv::COLOR_RGB2BGR);
    } else {
      recorded.copyTo(bgr);
    }
    const cv::Mat meters = depth_in_meters(raw, recorded_.depth_factor, recorded_.depth_sensor);
    return rectified_frame(rectifier_, bgr, registration_(meters),
                           kMilliseconds * color.get_timestamp(),
                           kMilliseconds * (depth.get_timestamp() - color.get_timestamp()));
  }

  rs2::pipeline pipeline_;
  rs2::pipeline_profile profile_;
  rs2::video_stream_profile color_, depth_;
  Camera recorded_;
  Rectifier rectifier_;
  DepthRegistration registration_;
};

}  // namespace

std::unique_ptr<LiveCamera> open_realsense(const std::string& name, const std::string& ignore) {
  try {
    return std::make_unique<RealsenseCamera>(name, ignore);
  } catch (const rs2::error& error) {
    throw Error(error.what(), kWhere + name,
                "connect the camera; `rs-enumerate-devices` lists the cameras and their serial "
                "numbers");
  }
}

}  // namespace stillmap

#else

namespace stillmap {

std::unique_ptr<LiveCamera> open_realsense(const std::string& name, const std::string& /*ignore*/) {
  throw Error("this stillmap was built without librealsense", "realsense:" + name,
              "install librealsense2-dev from Intel's repository and build again, or use "
              "examples/live_realsense.py");
}

}  // namespace stillmap

#endif
