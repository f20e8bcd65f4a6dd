# SPDX-License-Identifier: Apache-2.0
"""Parts that the examples for live cameras share: arguments, camera, and a run that always writes its results."""
import argparse
import signal
import sys
import time
from pathlib import Path

import numpy as np

import stillmap
from stillmap.lens import brown_coefficients

PATIENCE = 5  # Time without a usable frame after which a run ends [s], as of `stillmap run realsense:`.


def folder(text):
    """Returns the folder for the results, which exists from now on: a run must not fail at its end."""
    try:
        Path(text).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"cannot be made: {error}") from error
    return Path(text)


def parser(description):
    """Returns a parser of the argument RESULTS. A camera is started only after its parse_args()."""
    made = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("results", metavar="RESULTS", type=folder, help="folder to which the results are written")
    return made


def camera_of(size, fx, fy, cx, cy, lens="none", coefficients=(), depth_factor=1000, **more):
    """Returns the camera of color images of a size (width, height), to which depth images (by default in millimeters)
    are registered. lens: a name in stillmap.lens.LENSES; coefficients: in the order of OpenCV; more: arguments of stillmap.Camera."""
    found = brown_coefficients(lens, coefficients, *size, fx, fy, cx, cy)
    return stillmap.Camera(*size, fx, fy, cx, cy, distortion=found, depth_factor=depth_factor, **more)


def print_position(pose):
    print("lost" if pose is None else np.round(pose[:3, 3], 3))


def track(slam, frames, report=print_position):
    """Pushes frames (RGB, depth, time [s]) and reports the pose of each one. None is an attempt without a complete
    frame. A frame that cannot be used is printed. Raises TimeoutError if there is no usable frame for PATIENCE."""
    newest = time.monotonic()
    for frame in frames:
        try:
            if frame is not None:
                report(slam.push(*frame).T_world_camera)
                newest = time.monotonic()
        except stillmap.Error as error:
            print(error, file=sys.stderr)
        if time.monotonic() - newest > PATIENCE:
            raise TimeoutError(f"no usable frame for {PATIENCE} s")


def run(camera, frames, results, report=print_position):
    """Maps frames as track() does until they end, Ctrl-C, SIGTERM, or any error of the camera, and writes the results
    to a folder in all cases. Returns the text of the error, or None."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    slam = stillmap.Slam(camera, {"schedule.mode": "realtime"})
    problem = None
    try:
        track(slam, frames, report)
    except KeyboardInterrupt:
        pass
    except Exception as error:  # noqa: BLE001 - the packages of cameras raise errors of many types
        problem = f"The camera stopped: {error}\nThe results so far are in {results}."
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # A second Ctrl-C does not lose the results.
    slam.finish().write(results)
    return problem


def start(main):
    """Runs main() and ends the program with the text that it returns, or with that of the error of an unusable camera."""
    try:
        sys.exit(main())
    except (RuntimeError, OSError) as error:
        sys.exit(f"The camera cannot be used: {error}")
