#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with an Intel RealSense camera of the D400 series, until Ctrl-C.

  pip install pyrealsense2        live_realsense.py RESULTS

Tried with the software device of pyrealsense2 2.59.1, which delivered the images of a rendered recording.
Not tried with a camera: the alignment of depth to color and the schedule realtime.
"""
import live
import numpy as np
import pyrealsense2 as rs


def camera_of(color_profile, depth_scale):
    """Returns the camera of the color images. depth_scale: meters per depth unit."""
    i = color_profile.as_video_stream_profile().get_intrinsics()
    return live.camera_of((i.width, i.height), i.fx, i.fy, i.ppx, i.ppy, i.model.name, i.coeffs,
                          depth_factor=1 / depth_scale, fps=color_profile.fps(), sensor="realsense_d435i")


def frames_of(framesets):
    """Returns frames of sets with color (RGB8) and aligned depth (Z16)."""
    for frameset in framesets:
        color, depth = frameset.get_color_frame(), frameset.get_depth_frame()
        complete = color and depth
        yield (np.asanyarray(color.get_data()), np.asanyarray(depth.get_data()),
               color.get_timestamp() / 1000) if complete else None


def main():
    results = live.parser(__doc__).parse_args().results
    pipeline, config, align = rs.pipeline(), rs.config(), rs.align(rs.stream.color)
    config.enable_stream(rs.stream.color, 640, 480, rs.format.rgb8, 30)
    config.enable_stream(rs.stream.depth, 640, 480, rs.format.z16, 30)
    profile = pipeline.start(config)
    camera = camera_of(profile.get_stream(rs.stream.color), profile.get_device().first_depth_sensor().get_depth_scale())
    framesets = (align.process(pipeline.wait_for_frames(1000 * live.PATIENCE)) for _ in iter(int, 1))
    return live.run(camera, frames_of(framesets), results)


if __name__ == "__main__":
    live.start(main)
