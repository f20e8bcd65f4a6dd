#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with an iPhone or iPad with LiDAR and the app Record3D (USB streaming), until Ctrl-C.

  pip install record3d        live_record3d.py RESULTS

Every name of the API was checked against record3d 1.4.1, and track() tried with a stand-in for the stream.
Not tried with a phone: main(). The stream has no timestamps; the time of arrival is used.
"""
import sys
import threading
import time

import numpy as np
import record3d

import stillmap


def camera_of(matrix, shape):
    """Camera of every second pixel of color images of this shape (height, width)."""
    return stillmap.Camera(shape[1] // 2, shape[0] // 2, matrix.fx / 2, matrix.fy / 2, (matrix.tx - 0.5) / 2,
                           (matrix.ty - 0.5) / 2, fps=30, sensor="azure_kinect")


def frame_of(stream):
    """Color of half the size, and depth [m] of the same size; the stream's depth has fewer pixels of the same view."""
    rgb, depth = stream.get_rgb_frame(), stream.get_depth_frame()
    rgb = np.ascontiguousarray(rgb[: rgb.shape[0] // 2 * 2 : 2, : rgb.shape[1] // 2 * 2 : 2])
    rows, columns = (np.arange(size) * reduced // size for size, reduced in zip(rgb.shape, depth.shape))
    return rgb, np.ascontiguousarray(depth[rows][:, columns], np.float32)


def track(slam, stream, times):
    """Pushes a frame for each time [s], and prints the position of the camera."""
    for stamp in times:
        pose = slam.push(*frame_of(stream), stamp)
        print("lost" if pose is None else np.round(pose[:3, 3], 3))


def main():
    arrived, stream = threading.Event(), record3d.Record3DStream()
    stream.on_new_frame = arrived.set
    stream.connect(record3d.Record3DStream.get_connected_devices()[0])

    def times():
        while arrived.wait():
            arrived.clear()
            yield time.monotonic()

    next(times())
    slam = stillmap.Slam(camera_of(stream.get_intrinsic_mat(), stream.get_rgb_frame().shape), {"schedule.mode": "realtime"})
    try:
        track(slam, stream, times())
    except KeyboardInterrupt:
        stream.disconnect()
    slam.finish().write(sys.argv[1])


if __name__ == "__main__":
    main()
