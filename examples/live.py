# SPDX-License-Identifier: Apache-2.0
"""Parts that the examples for live cameras share: arguments, camera, and a run that always writes its results."""
import argparse
import signal
import sys
import time
from pathlib import Path

import numpy as np

import stillmap

PATIENCE = 5  # Time without a usable frame after which a run ends [s], as of `stillmap run realsense:`.
FIT_ERROR = 0.25  # Largest error of a fitted distortion [pixels], a fraction of that of a keypoint.
RECTIFY = "\n  fix: give rectified images (with ROS the topics of image_proc), or record them for `stillmap run`"
# Families of lenses by their names in librealsense, the SDK of Orbbec and ROS. librealsense's modified model has the
# coefficients of Brown's model to first order.
LENSES = {"none": "rational", "brown_conrady": "rational", "brown_conrady_k6": "rational",
          "modified_brown_conrady": "rational", "plumb_bob": "rational", "rational_polynomial": "rational",
          "inverse_brown_conrady": "inverse",
          "kannala_brandt4": "equidistant", "equidistant": "equidistant", "fisheye": "equidistant"}


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


def polynomial(x, y, k1, k2, p1, p2, k3, k4=0, k5=0, k6=0):
    """Returns points that Brown's model distorts, with a denominator (k4, k5, k6) the rational model (OpenCV)."""
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def equidistant(x, y, *k):
    """Returns points that the equidistant fisheye model distorts (Kannala and Brandt, PAMI 2006)."""
    r = np.hypot(x, y)
    angle = np.arctan(r)
    radius = angle * (1 + sum(c * angle ** (2 * i + 2) for i, c in enumerate(k)))
    ratio = np.divide(radius, r, out=np.ones_like(r), where=r > 0)
    return x * ratio, y * ratio


def distortion(lens, coefficients, width, height, fx, fy, cx, cy):
    """Returns Brown's k1 k2 p1 p2 k3 for a lens, fitted to it over the image if its model is another one."""
    coefficients = np.trim_zeros(np.asarray(coefficients, float), "b")
    size = {"rational": 8, "inverse": 5, "equidistant": 4}.get(LENSES.get(lens.lower()), 0)
    if len(coefficients) > size:
        raise SystemExit(f"The lens has the model '{lens}' with {len(coefficients)} coefficients, which is not supported."
                         + RECTIFY)
    model, given = LENSES.get(lens.lower()), np.pad(coefficients, (0, size - len(coefficients)))
    if model == "rational" and len(coefficients) <= 5 or not len(coefficients):
        return np.pad(coefficients, (0, 5))[:5]
    grid = np.meshgrid((np.linspace(0, width - 1, 41) - cx) / fx, (np.linspace(0, height - 1, 31) - cy) / fy)
    x, y = (axis.ravel() for axis in grid)
    u, v = equidistant(x, y, *given) if model == "equidistant" else polynomial(x, y, *given)
    if model == "inverse":  # Its polynomial maps distorted to ideal points.
        x, y, u, v = u, v, x, y
    # The distorted points of Brown's model are a linear function of its coefficients.
    columns = [np.subtract(polynomial(x, y, *row), (x, y)).ravel() for row in np.eye(5)]
    fitted = np.linalg.lstsq(np.transpose(columns), np.concatenate([u - x, v - y]), rcond=None)[0]
    error = np.abs(np.subtract(polynomial(x, y, *fitted), (u, v)) * [[fx], [fy]]).max()
    if error > FIT_ERROR:
        raise SystemExit(f"Brown's model differs from the lens ('{lens}') by {error:.2g} pixels." + RECTIFY)
    return fitted


def camera_of(size, fx, fy, cx, cy, lens="none", coefficients=(), depth_factor=1000, **more):
    """Returns the camera of color images of a size (width, height), to which depth images (by default in millimeters)
    are registered. lens: a name in LENSES; coefficients: in the order of OpenCV; more: arguments of stillmap.Camera."""
    found = distortion(lens, coefficients, *size, fx, fy, cx, cy)
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
                report(slam.push(*frame))
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
