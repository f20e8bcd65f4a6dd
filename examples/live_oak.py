#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with a Luxonis OAK-D camera, until Ctrl-C.

  pip install depthai        live_oak.py RESULTS

Every name of the API was checked against depthai 3.12.0, and track() tried with stand-ins for its messages.
Not tried with a camera: main(), with the alignment of depth to color and the schedule realtime.
"""
import sys

import depthai as dai
import numpy as np

import stillmap

SIZE, FPS = (640, 400), 30
BASELINE = 0.075  # [m] of the OAK-D and OAK-D Pro


def camera_of(matrix):
    """Camera of the undistorted color images, of a 3 x 3 matrix; depth is in millimeters."""
    return stillmap.Camera(*SIZE, matrix[0][0], matrix[1][1], matrix[0][2], matrix[1][2], depth_factor=1000, fps=FPS,
                           sensor="stereo", baseline=BASELINE)


def track(slam, groups):
    """Pushes groups of a color and a depth message, and prints the position of the camera."""
    for group in groups:
        color, depth = group["color"], group["depth"]
        pose = slam.push(color.getFrame(), depth.getFrame(), color.getTimestampDevice().total_seconds())
        print("lost" if pose is None else np.round(pose[:3, 3], 3))


def main():
    with dai.Pipeline() as pipeline:
        def output(socket, **options):
            return pipeline.create(dai.node.Camera).build(socket).requestOutput(SIZE, fps=FPS, **options)

        sockets = dai.CameraBoardSocket
        color = output(sockets.CAM_A, type=dai.ImgFrame.Type.RGB888i, enableUndistortion=True)
        stereo, sync = pipeline.create(dai.node.StereoDepth), pipeline.create(dai.node.Sync)
        output(sockets.CAM_B).link(stereo.left)
        output(sockets.CAM_C).link(stereo.right)
        color.link(stereo.inputAlignTo)  # A device of the series 4 needs the node ImageAlign instead.
        color.link(sync.inputs["color"])
        stereo.depth.link(sync.inputs["depth"])
        queue = sync.out.createOutputQueue(maxSize=1, blocking=False)  # The newest frame replaces older ones.
        pipeline.start()
        calibration = pipeline.getDefaultDevice().readCalibration()
        slam = stillmap.Slam(camera_of(calibration.getCameraIntrinsics(sockets.CAM_A, *SIZE)), {"schedule.mode": "realtime"})
        try:
            track(slam, iter(queue.get, None))
        except KeyboardInterrupt:
            pipeline.stop()
        slam.finish().write(sys.argv[1])


if __name__ == "__main__":
    main()
