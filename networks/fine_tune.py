# SPDX-License-Identifier: Apache-2.0
"""Trains YOLO11n or YOLOv8n-seg by the package ultralytics (AGPL-3.0, not part of this project).

The settings are those of "Visual SLAM algorithm based on YOLO11n in dynamic scene" (Feng et al., 2026): pretrained
weights, learning rate 0.001, batch 16, 500 epochs, stop after 50 without improvement, IoU 0.5, images split 9:1 into
training and validation. The data are the same as for YOLOv7: COCO, or sequences of `stillmap simulate`.
"""
import random
from pathlib import Path

import cv2
import numpy as np

from networks.data import read_samples

PRETRAINED = {"yolo11n": "yolo11n.pt", "yolov8n-seg": "yolov8n-seg.pt"}
RATE, EPOCHS, PATIENCE, IOU, TRAINING_SHARE = 0.001, 500, 50, 0.5, 0.9


def label_lines(sample, segments):
    """Returns the objects of a sample in the label format of ultralytics: class, then center and size of the box or,
    with `segments`, the corners of the outline; all relative to the image size."""
    height, width = cv2.imread(str(sample.file)).shape[:2]
    lines = []
    for (x0, y0, x1, y1), category, crowd, outline in zip(sample.boxes, sample.classes, sample.crowd, sample.outlines):
        if crowd or (segments and outline is None):
            continue
        points = outline if segments else np.array([[(x0 + x1) / 2, (y0 + y1) / 2], [x1 - x0, y1 - y0]])
        lines.append(" ".join([str(category), *(f"{value:.6f}" for value in (points / [width, height]).reshape(-1))]))
    return lines


def write_dataset(samples, names, folder, segments, seed=1):
    """Writes images (as links) and labels in the layout of ultralytics, split at random. Returns the description."""
    order = list(samples)
    random.Random(seed).shuffle(order)
    training = round(TRAINING_SHARE * len(order))
    for split, part in (("train", order[:training]), ("val", order[training:])):
        for kind in ("images", "labels"):
            (folder / kind / split).mkdir(parents=True, exist_ok=True)
        for number, sample in enumerate(part):
            name = f"{number:06}"
            link = folder / "images" / split / (name + sample.file.suffix)
            link.unlink(missing_ok=True)
            link.symlink_to(sample.file.resolve())
            text = "\n".join(label_lines(sample, segments))
            (folder / "labels" / split / f"{name}.txt").write_text(text, encoding="utf-8")
    lines = [f"path: {folder.resolve()}", "train: images/train", "val: images/val", "names:"]
    lines += [f"  {i}: {name}" for i, name in enumerate(names)]
    (folder / "data.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "data.yaml"


def train(settings):
    """Trains with the settings of networks.train; weights and log are written by ultralytics below `settings.out`."""
    try:
        from ultralytics import YOLO  # only here: the package is optional
    except ImportError as missing:
        raise SystemExit(f"networks.train: {missing}; fix: pip install ultralytics") from missing
    segments = settings.architecture.endswith("-seg")
    samples, names = read_samples(settings.data, "train")
    data = write_dataset(samples, names, Path(settings.out) / "data", segments)
    YOLO(str(settings.weights or PRETRAINED[settings.architecture])).train(
        data=str(data), epochs=settings.epochs, patience=PATIENCE, batch=settings.batch, lr0=settings.rate, iou=IOU,
        imgsz=max(settings.size), device=settings.device, workers=settings.workers, seed=settings.seed,
        project=str(settings.out))
