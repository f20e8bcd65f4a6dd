#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with an Orbbec camera (Femto Bolt, Femto Mega, Gemini, Astra 2), until Ctrl-C.

  pip install pyorbbecsdk2        live_orbbec.py RESULTS [SENSOR]     SENSOR: azure_kinect (Femto, the default) or
                                                                    realsense_d435i (Gemini, Astra: stereo)

Every name of the API was checked against pyorbbecsdk2 2.1.2, and track() tried with stand-ins for its frames.
Not tried with a camera: main(), with the alignment of depth to color and the schedule realtime.
"""
import sys

import numpy as np
import pyorbbecsdk as ob

import stillmap


def camera_of(profile, sensor):
    """Camera of the color images, to which the depth images are aligned; depth is in millimeters."""
    i, d = profile.get_intrinsic(), profile.get_distortion()
    return stillmap.Camera(i.width, i.height, i.fx, i.fy, i.cx, i.cy, distortion=[d.k1, d.k2, d.p1, d.p2, d.k3],
                           depth_factor=1000, fps=profile.get_fps(), sensor=sensor)


def track(slam, frames):
    """Pushes sets of a color (RGB) and an aligned depth frame (Y16), and prints the position of the camera."""
    for frame in frames:
        color, depth = frame.get_color_frame(), frame.get_depth_frame()
        if color is None or depth is None:
            continue
        shape = color.get_height(), color.get_width()
        rgb = np.frombuffer(color.get_data(), np.uint8).reshape(*shape, 3)
        raw = np.frombuffer(depth.get_data(), np.uint16).reshape(shape)
        millimeters = np.round(raw * depth.get_depth_scale()).astype(np.uint16)
        pose = slam.push(rgb, millimeters, color.get_timestamp_us() / 1e6)
        print("lost" if pose is None else np.round(pose[:3, 3], 3))


def main():
    pipeline, config = ob.Pipeline(), ob.Config()
    colors = pipeline.get_stream_profile_list(ob.OBSensorType.COLOR_SENSOR)
    profile = colors.get_video_stream_profile(1280, 0, ob.OBFormat.RGB, 30)
    config.enable_stream(profile)
    depths = pipeline.get_stream_profile_list(ob.OBSensorType.DEPTH_SENSOR)
    config.enable_stream(depths.get_default_video_stream_profile())
    config.set_frame_aggregate_output_mode(ob.OBFrameAggregateOutputMode.FULL_FRAME_REQUIRE)
    pipeline.enable_frame_sync()
    pipeline.start(config)
    align = ob.AlignFilter(ob.OBStreamType.COLOR_STREAM)
    sensor = sys.argv[2] if len(sys.argv) > 2 else "azure_kinect"
    slam = stillmap.Slam(camera_of(profile, sensor), {"schedule.mode": "realtime"})
    sets = (pipeline.wait_for_frames(1000) for _ in iter(int, 1))
    try:
        track(slam, (align.process(frames).as_frame_set() for frames in sets if frames))
    except KeyboardInterrupt:
        pipeline.stop()
    slam.finish().write(sys.argv[1])


if __name__ == "__main__":
    main()
