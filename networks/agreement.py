# SPDX-License-Identifier: Apache-2.0
"""Compares the detections of PyTorch with those of Stillmap's C++ decoder, for both layouts of the export.

  python -m networks.agreement best.pt IMAGE.png... --size 256 320

Needs build/release/stillmap_lab, or the one that the environment variable STILLMAP_LAB names.
"""
import argparse
import csv
import os
import subprocess
import tempfile
from pathlib import Path

import cv2
import numpy as np
import torch

from networks import yolov7
from networks.boxes import Decoded, Letterbox, detections, to_tensor
from networks.export import export

LAB = Path(os.environ.get("STILLMAP_LAB", Path(__file__).parent.parent / "build/release/stillmap_lab"))


def decode_by_pytorch(network, image, size):
    """Returns the decoded output of an 8-bit BGR image [anchors, 5 + classes], and its letterbox."""
    place = Letterbox(image.shape[:2], size)
    with torch.no_grad():
        return Decoded(network, *size)(to_tensor(place.fill(image)[None]))[0], place


def rows_of_pytorch(network, image, size, confidence):
    """Returns class, confidence and corners of each detection [n, 6], in image pixels."""
    decoded, place = decode_by_pytorch(network, image, size)
    boxes, scores, classes = (values.numpy().astype(float) for values in detections(decoded, confidence))
    return np.column_stack([classes, scores, place.to_image(boxes)])


def rows_of_stillmap(model, names, image_file, confidence, backend="auto"):
    """Returns the same as rows_of_pytorch(), from `stillmap_lab detect`."""
    printed = subprocess.run([LAB, "detect", image_file, "--model", model, "--backend", backend, "--confidence",
                              str(confidence)], check=True, capture_output=True, text=True).stdout
    rows = [[names.index(row["class"]), *(float(row[k]) for k in ("confidence", "x0", "y0", "x1", "y1"))]
            for row in csv.DictReader(printed.splitlines())]
    return np.array(rows).reshape(-1, 6)


def largest_difference(found, expected):
    """Returns the largest difference of confidence, and of a corner [pixels], between detections in any order; infinite
    where the detections are not the same ones."""
    if len(found) != len(expected):
        return np.inf, np.inf
    if not len(found):
        return 0.0, 0.0
    nearest = np.abs(found[:, None] - expected).max(2).argmin(0)
    if sorted(nearest) != list(range(len(found))) or (found[nearest, 0] != expected[:, 0]).any():
        return np.inf, np.inf
    difference = np.abs(found[nearest] - expected).max(0)
    return difference[1], difference[2:].max()


def main(words=None):
    parser = argparse.ArgumentParser(prog="python -m networks.agreement", description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path)
    parser.add_argument("images", type=Path, nargs="+")
    parser.add_argument("--size", type=int, nargs=2, default=[480, 640], metavar=("HEIGHT", "WIDTH"))
    parser.add_argument("--confidence", type=float, default=0.25)
    settings = parser.parse_args(words)
    network, names = yolov7.load(settings.weights)
    with tempfile.TemporaryDirectory() as folder:
        for raw in (False, True):
            model = Path(folder) / f"raw_{raw}.onnx"
            export(network, names, settings.size, model, raw)
            count, differences = 0, []
            for file in settings.images:
                expected = rows_of_pytorch(network, cv2.imread(str(file)), settings.size, settings.confidence)
                found = rows_of_stillmap(model, names, file, settings.confidence)
                differences.append(largest_difference(found, expected))
                count += len(expected)
            confidence, corner = np.max(differences, 0)
            print(f"{'three heads' if raw else 'decoded'}: {count} detections in {len(settings.images)} images; "
                  f"largest difference of a confidence {confidence:.1e}, of a corner {corner:.1e} pixels")


if __name__ == "__main__":
    main()
