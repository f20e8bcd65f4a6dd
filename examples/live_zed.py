#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Maps with a ZED camera of Stereolabs until Ctrl-C, or one of its recordings.

  live_zed.py RESULTS [--svo FILE]      Needs the ZED SDK and its module pyzed (get_python_api.py of the SDK).

frames_of() and camera_of() were tried with stand-ins. Not tried: the SDK, which is not a public package.
"""
import live
from pyzed import sl


def camera_of(configuration):
    """Returns the left camera, whose images are rectified. Its depth is in meters."""
    calibration, size = configuration.calibration_parameters, configuration.resolution
    left = calibration.left_cam
    return live.camera_of((size.width, size.height), left.fx, left.fy, left.cx, left.cy, fps=configuration.fps,
                          sensor="stereo", baseline=calibration.get_camera_baseline())


def frames_of(zed):
    """Returns the left images with depth until the end of a recording; None is an attempt without a frame."""
    image, depth = sl.Mat(), sl.Mat()
    while (state := zed.grab()) != sl.ERROR_CODE.END_OF_SVOFILE_REACHED:
        if state != sl.ERROR_CODE.SUCCESS:
            yield None
            continue
        zed.retrieve_image(image, sl.VIEW.LEFT)
        zed.retrieve_measure(depth, sl.MEASURE.DEPTH)
        stamp = zed.get_timestamp(sl.TIME_REFERENCE.IMAGE).get_nanoseconds() / 1e9
        yield image.get_data()[:, :, 2::-1], depth.get_data(), stamp  # BGRA to RGB


def main():
    parser = live.parser(__doc__)
    parser.add_argument("--svo", help="recording of the ZED SDK (.svo, .svo2) instead of a camera")
    arguments = parser.parse_args()
    settings = sl.InitParameters(camera_resolution=sl.RESOLUTION.HD720, coordinate_units=sl.UNIT.METER)
    if arguments.svo:
        settings.set_from_svo_file(arguments.svo)
        settings.svo_real_time_mode = True
    zed = sl.Camera()
    state = zed.open(settings)
    if state != sl.ERROR_CODE.SUCCESS:
        return f"The ZED SDK opens no camera or recording: {state}"
    return live.run(camera_of(zed.get_camera_information().camera_configuration), frames_of(zed), arguments.results)


if __name__ == "__main__":
    live.start(main)
