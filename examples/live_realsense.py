#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with an Intel RealSense camera of the D400 series, until Ctrl-C.

  pip install pyrealsense2        live_realsense.py RESULTS

Tried with the software device of pyrealsense2 2.59.1, which delivered the images of a rendered recording to track().
Not tried with a camera: main(), with the alignment of depth to color and the schedule realtime.
"""
import sys

import numpy as np
import pyrealsense2 as rs

import stillmap


def camera_of(color_profile, depth_scale):
    """Camera of the color images, to which the depth images are aligned. depth_scale: meters per depth unit."""
    i = color_profile.as_video_stream_profile().get_intrinsics()
    brown = i.model == rs.distortion.brown_conrady  # the coefficients of other models are another function
    return stillmap.Camera(i.width, i.height, i.fx, i.fy, i.ppx, i.ppy, distortion=i.coeffs if brown else [0.0] * 5,
                           depth_factor=1 / depth_scale, fps=color_profile.fps(), sensor="realsense_d435i")


def track(slam, frames):
    """Pushes frames with color (RGB8) and aligned depth (Z16), and prints the position of the camera."""
    for frame in frames:
        color, depth = frame.get_color_frame(), frame.get_depth_frame()
        if color and depth:
            pose = slam.push(np.asanyarray(color.get_data()), np.asanyarray(depth.get_data()),
                             color.get_timestamp() / 1000)
            print("lost" if pose is None else np.round(pose[:3, 3], 3))


def main():
    pipeline, config = rs.pipeline(), rs.config()
    config.enable_stream(rs.stream.color, 640, 480, rs.format.rgb8, 30)
    config.enable_stream(rs.stream.depth, 640, 480, rs.format.z16, 30)
    profile = pipeline.start(config)
    align = rs.align(rs.stream.color)
    depth_scale = profile.get_device().first_depth_sensor().get_depth_scale()
    slam = stillmap.Slam(camera_of(profile.get_stream(rs.stream.color), depth_scale), {"schedule.mode": "realtime"})
    try:
        track(slam, (align.process(pipeline.wait_for_frames()) for _ in iter(int, 1)))
    except KeyboardInterrupt:
        pipeline.stop()
    slam.finish().write(sys.argv[1])


if __name__ == "__main__":
    main()
