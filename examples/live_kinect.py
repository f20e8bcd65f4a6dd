#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with a Kinect of the Xbox 360 without ROS, until Ctrl-C.

  live_kinect.py RESULTS      Needs libfreenect and its Python module freenect (wrappers/python in libfreenect).

The intrinsics are the nominal ones of the sensor; calibrated ones make the map more accurate.
frames_of() was tried with stand-ins for the images. Not tried with a Kinect.
"""
import time

import freenect
import live

CAMERA = live.camera_of((640, 480), 525, 525, 319.5, 239.5, sensor="kinect_v1")


def frames_of(attempts):
    """Returns a frame for each attempt: RGB, and depth [mm] that libfreenect registers to it; None without images."""
    for _ in attempts:
        color, depth = freenect.sync_get_video(), freenect.sync_get_depth(format=freenect.DEPTH_REGISTERED)
        yield (color[0], depth[0], time.monotonic()) if color and depth else None


def main():
    results = live.parser(__doc__).parse_args().results
    return live.run(CAMERA, frames_of(iter(int, 1)), results)


if __name__ == "__main__":
    live.start(main)
