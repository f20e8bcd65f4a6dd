#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with an iPhone or iPad with LiDAR and the app Record3D (USB streaming), until Ctrl-C.

  pip install record3d        live_record3d.py RESULTS

Every name of the API was checked against record3d 1.4.1, and frames_of() tried with a stand-in for the stream.
Not tried with a phone: main(). The stream has no timestamps; the time of arrival is used.
"""
import threading
import time

import live
import numpy as np
import record3d


def camera_of(matrix, shape):
    """Returns the camera of every second pixel of color images of this shape (height, width). Its depth is in meters."""
    return live.camera_of((shape[1] // 2, shape[0] // 2), matrix.fx / 2, matrix.fy / 2, (matrix.tx - 0.5) / 2,
                          (matrix.ty - 0.5) / 2, fps=30, sensor="azure_kinect")


def images_of(stream):
    """Returns color of half the size, and depth [m] of the same size; the stream's depth has fewer pixels of the same
    view."""
    rgb, depth = stream.get_rgb_frame(), stream.get_depth_frame()
    rgb = rgb[: rgb.shape[0] // 2 * 2 : 2, : rgb.shape[1] // 2 * 2 : 2]
    rows, columns = (np.arange(size) * reduced // size for size, reduced in zip(rgb.shape, depth.shape))
    return rgb, np.asarray(depth[rows][:, columns], np.float32)


def frames_of(stream, arrivals):
    """Returns a frame for each arrival, a time [s]; None is an attempt without one."""
    for stamp in arrivals:
        yield None if stamp is None else (*images_of(stream), stamp)


def main():
    results = live.parser(__doc__).parse_args().results
    arrived, stream = threading.Event(), record3d.Record3DStream()
    stream.on_new_frame = arrived.set
    devices = record3d.Record3DStream.get_connected_devices()
    if not devices or not stream.connect(devices[0]) or not arrived.wait(live.PATIENCE):
        return "No frame came from a phone.\n  fix: connect it by USB and start the USB streaming in the app Record3D"

    def arrivals():
        while True:
            yield time.monotonic() if arrived.wait(1) else None
            arrived.clear()

    camera = camera_of(stream.get_intrinsic_mat(), stream.get_rgb_frame().shape)
    return live.run(camera, frames_of(stream, arrivals()), results)


if __name__ == "__main__":
    live.start(main)
