# SPDX-License-Identifier: Apache-2.0
"""Images and cameras of messages. Pixels are views of the message's memory wherever its layout allows it."""
import struct

import cv2
import numpy as np

import stillmap
from stillmap.lens import brown_coefficients

SAME, REVERSED, FIRST = slice(0, 3), slice(2, None, -1), 0  # channels of a pixel that are used
COLOR = {"rgb8": (np.uint8, 3, SAME), "rgba8": (np.uint8, 4, SAME), "bgr8": (np.uint8, 3, REVERSED),
         "bgra8": (np.uint8, 4, REVERSED), "8UC3": (np.uint8, 3, REVERSED), "mono8": (np.uint8, 1, FIRST),
         "8UC1": (np.uint8, 1, FIRST)}
DEPTH = {"mono16": (np.uint16, 1, FIRST), "16UC1": (np.uint16, 1, FIRST), "32FC1": (np.float32, 1, FIRST)}
# compressedDepth: format (0: PNG or RVL) as int32, and two floats of the quantization of 32FC1.
DEPTH_HEADER = struct.Struct("<iff")
RVL_HEADER = struct.Struct("<II")  # columns and rows


class ImageError(ValueError):
    """An image that cannot be read."""


def nanoseconds(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def seconds(stamp):
    return nanoseconds(stamp) / 10**9


def raw_pixels(message, encodings):
    """Returns the pixels of an Image in one of the encodings COLOR or DEPTH."""
    if message.encoding not in encodings:
        raise ImageError(f"images of the encoding '{message.encoding}' are not read here\n"
                         f"  fix: give a topic with one of {', '.join(encodings)}, such as those of image_proc")
    kind, channels, used = encodings[message.encoding]
    stored = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    strides = (message.step, channels * stored.itemsize, stored.itemsize)
    if len(message.data) < message.height * message.step or message.step < message.width * strides[1]:
        raise ImageError(f"an image of {message.width} x {message.height} pixels has {len(message.data)} bytes")
    pixels = np.ndarray((message.height, message.width, channels), stored, message.data, strides=strides)
    return pixels[:, :, used].astype(kind, copy=False)


def decoded(data, flags):
    pixels = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    if pixels is None:
        raise ImageError("a compressed image cannot be decoded")
    return pixels


def compressed_color(message):
    pixels = decoded(message.data, cv2.IMREAD_UNCHANGED)
    return pixels if pixels.ndim == 2 else pixels[:, :, 2::-1]


def decoded_rvl(data):
    """Returns uint16 pixels of Wilson's RVL ("Fast Lossless Depth Image Compression", 2017): runs of zeros and of others,
    whose differences and lengths are numbers of nibbles with three bits each, the lowest first, and a bit that continues."""
    columns, rows = RVL_HEADER.unpack_from(data)
    words = np.frombuffer(data, "<u4", offset=RVL_HEADER.size, count=(len(data) - RVL_HEADER.size) // 4)
    nibbles = (words[:, None] >> np.arange(28, -1, -4, dtype=np.uint32) & 15).ravel().astype(np.int64)
    ends = np.flatnonzero(nibbles < 8)  # of the numbers; those after the last one only fill its word
    starts = np.concatenate([[0], ends[:-1] + 1])[:len(ends)]
    place = np.arange(starts.size and ends[-1] + 1) - np.repeat(starts, ends - starts + 1)
    numbers = np.add.reduceat((nibbles[:len(place)] & 7) << (3 * place), starts) if len(place) else starts
    pixels, at, read, previous = np.zeros(columns * rows, np.int64), 0, 0, 0
    while at < len(pixels):
        if read + 2 > len(numbers):
            raise ImageError("a compressed depth image ends early")
        zeros, others = numbers[read:read + 2]
        differences = numbers[read + 2:read + 2 + others]
        at, read = at + zeros, read + 2 + others
        if len(differences) < others or at + others > len(pixels):
            raise ImageError("a compressed depth image ends early")
        if others:
            run = previous + np.cumsum((differences >> 1) ^ -(differences & 1))
            pixels[at:at + others], previous = run, run[-1]
        at += others
    return pixels.astype(np.uint16).reshape(rows, columns)


def compressed_depth(message):
    """Returns uint16 [mm] or float32 [m] of a message of compressed_depth_image_transport."""
    if len(message.data) < DEPTH_HEADER.size + RVL_HEADER.size:
        raise ImageError(f"a compressed depth image has {len(message.data)} bytes")
    _, a, b = DEPTH_HEADER.unpack_from(message.data)
    data = memoryview(message.data)[DEPTH_HEADER.size:]
    pixels = decoded_rvl(data) if "rvl" in message.format.lower() else decoded(data, cv2.IMREAD_UNCHANGED)
    if not message.format.startswith("32FC1"):
        return pixels
    inverse = pixels.astype(np.float32)
    return np.where(inverse > 0, np.float32(a) / np.maximum(inverse - np.float32(b), 1e-6), 0).astype(np.float32)


def stereo_camera_of(info, ignore):
    """Returns the camera of a rectified stereo pair by the CameraInfo of its right camera."""
    p = np.reshape(info.p, (3, 4))
    if not p[0, 0] > 0 or not p[0, 3] < 0:
        raise ImageError("P of camera_info contains no baseline, so it is not from the right camera of a rectified pair\n"
                         "  fix: remap camera_info to the topic of the right camera")
    camera = stillmap.Camera(info.width, info.height, p[0, 0], p[1, 1], p[0, 2], p[1, 2], depth_factor=1000,
                             sensor="stereo", baseline=-p[0, 3] / p[0, 0])
    camera.ignore = ignore
    return camera


def camera_of(info, sensor, rectified, ignore):
    """Returns the camera of a CameraInfo message; rectified: of the images that image_proc rectified."""
    matrix = np.reshape(info.p if rectified else info.k, (3, -1))
    fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    if not fx > 0:
        raise ImageError("camera_info has no focal length\n  fix: calibrate the camera, or start its driver with a file")
    lens, given = (info.distortion_model or "none", info.d) if not rectified else ("none", [])
    camera = stillmap.Camera(info.width, info.height, fx, fy, cx, cy, depth_factor=1000, sensor=sensor,
                             distortion=brown_coefficients(lens, given, info.width, info.height, fx, fy, cx, cy))
    camera.ignore = ignore
    return camera
