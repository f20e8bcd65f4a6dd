# SPDX-License-Identifier: Apache-2.0
"""Lenses of the SDKs of cameras and of ROS as the distortion of stillmap.Camera."""
import numpy as np

FIT_ERROR = 0.25  # Largest error of a fitted distortion [pixels], well below the error of a keypoint.
# Families of lenses by their names in librealsense, the SDK of Orbbec and ROS. librealsense's modified model has the
# coefficients of Brown's model to first order.
LENSES = {"none": "rational", "brown_conrady": "rational", "brown_conrady_k6": "rational",
          "modified_brown_conrady": "rational", "plumb_bob": "rational", "rational_polynomial": "rational",
          "inverse_brown_conrady": "inverse",
          "kannala_brandt4": "equidistant", "equidistant": "equidistant", "fisheye": "equidistant"}
SIZES = {"rational": 8, "inverse": 5, "equidistant": 4}


class LensError(RuntimeError):
    """A lens that stillmap.Camera cannot describe."""

    def __init__(self, problem):
        super().__init__(f"{problem}\n  fix: give rectified images (with ROS the topics of image_proc), or record them "
                         "for `stillmap run`")


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


def brown_coefficients(lens, coefficients, width, height, fx, fy, cx, cy):
    """Returns Brown's k1 k2 p1 p2 k3 for a lens of LENSES, fitted to it over the image if its model is another one.
    coefficients: in the order of OpenCV. Raises LensError for an unknown model, or if Brown's differs from it."""
    coefficients = np.trim_zeros(np.asarray(coefficients, float), "b")
    model = LENSES.get(lens.lower())
    size = SIZES.get(model, 0)
    if len(coefficients) > size:
        raise LensError(f"The lens has the model '{lens}' with {len(coefficients)} coefficients, which is not supported.")
    given = np.pad(coefficients, (0, size - len(coefficients)))
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
        raise LensError(f"Brown's model differs from the lens ('{lens}') by {error:.2g} pixels.")
    return fitted
