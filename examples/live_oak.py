#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with a Luxonis OAK-D camera, until Ctrl-C.

  pip install depthai        live_oak.py RESULTS

Every name of the API was checked against depthai 3.12.0, and frames_of() tried with stand-ins for its messages.
Not tried with a camera: main(), with the alignment of depth to color and the schedule realtime.
"""
import datetime

import depthai as dai
import live

SIZE, FPS = (640, 400), 30
BASELINE = 0.075  # [m] of the OAK-D and OAK-D Pro


def camera_of(matrix):
    """Returns the camera of the undistorted color images, of a 3 x 3 matrix."""
    return live.camera_of(SIZE, matrix[0][0], matrix[1][1], matrix[0][2], matrix[1][2], fps=FPS, sensor="stereo",
                          baseline=BASELINE)


def frames_of(groups):
    """Returns frames of groups of a color and a depth message; None is an attempt without one."""
    for group in groups:
        yield group and (group["color"].getFrame(), group["depth"].getFrame(),
                         group["color"].getTimestampDevice().total_seconds())


def main():
    results = live.parser(__doc__).parse_args().results
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
        groups = (queue.get(datetime.timedelta(seconds=1)) for _ in iter(int, 1))
        return live.run(camera_of(calibration.getCameraIntrinsics(sockets.CAM_A, *SIZE)), frames_of(groups), results)


if __name__ == "__main__":
    live.start(main)
