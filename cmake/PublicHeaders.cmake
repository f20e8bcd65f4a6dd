# The headers that are installed, relative to stillmap/. They include each other and third-party headers only; the
# test `install` compiles each of them alone.
set(STILLMAP_PUBLIC_HEADERS
  base/error.hpp
  base/finding.hpp
  dense/cloud.hpp
  evaluate.hpp
  geometry/camera.hpp
  geometry/depth_sensor.hpp
  geometry/motion_sensors.hpp
  geometry/pose.hpp
  geometry/trajectory.hpp
  options.hpp
  segment/detector.hpp
  segment/instance.hpp
  sensor/frame_source.hpp
  sensor/make_source.hpp
  sensor/rgbd_frame.hpp
  slam.hpp
  warn/warning_event.hpp
  write_results.hpp)
