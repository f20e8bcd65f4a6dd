# SPDX-License-Identifier: Apache-2.0
"""Images with true boxes: COCO in its usual layout, or sequences of `stillmap simulate`; and their augmentation."""
import csv
import json
import random
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import torch
from torch.utils.data import Dataset

from networks.boxes import GRAY, Letterbox, to_tensor

PERSON = 255  # of mask/ in a simulated sequence
MIN_SIDE = 8  # boxes of simulated movers with a shorter side are left out [pixels]


@dataclass
class Sample:
    """An image and its objects. Boxes are corners in image pixels, edge coordinates [n, 4]; classes are indices [n]."""
    file: Path
    boxes: np.ndarray
    classes: np.ndarray
    crowd: np.ndarray  # true for groups that COCO's evaluation ignores [n]
    outlines: list  # corners of the largest visible part of each object [k, 2]


def largest(outlines):
    """Returns the outline with the largest area, [k, 2]."""
    return max((np.array(o, np.float32).reshape(-1, 2) for o in outlines), key=cv2.contourArea)


def mover_names(folder):
    """Names ("person", "hook", "vehicle", ...) of the movers of a simulated sequence by their numbers in instance/, from
    truth_movers.csv; empty without this file, so that only people are known."""
    file = folder / "truth_movers.csv"
    if not file.exists():
        return {}
    with file.open(encoding="utf-8", newline="") as lines:
        return {int(row["id"]): row["name"] for row in csv.DictReader(lines)}


def class_names(folders):
    """Names of the classes of simulated sequences: person, then the other movers in alphabetical order."""
    found = {name for folder in folders for name in mover_names(folder).values()}
    return ["person", *sorted(found - {"person"})]


def visible_movers(mask, instance, names):
    """Boxes [n, 4], class names and outlines of the visible pixels of each mover with a name, from the 8-bit images
    mask/ and instance/ of a simulated sequence."""
    boxes, found_names, outlines = [], [], []
    for number in np.unique(instance[instance > 0]):
        mover = instance == number
        name = "person" if (mask[mover] == PERSON).all() else names.get(int(number))
        rows, columns = np.nonzero(mover)
        box = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
        if name and min(box[2] - box[0], box[3] - box[1]) >= MIN_SIDE:
            boxes.append(box)
            found_names.append(name)
            found, _ = cv2.findContours(mover.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
            outlines.append(largest(found))
    return np.array(boxes, float).reshape(-1, 4), found_names, outlines


def simulated_samples(folder, classes):
    """Samples of one sequence of `stillmap simulate`; `classes` as returned by class_names()."""
    samples, names = [], mover_names(folder)
    for file in sorted((folder / "rgb").glob("*.png")):
        mask, instance = (cv2.imread(str(folder / kind / file.name), cv2.IMREAD_UNCHANGED)
                          for kind in ("mask", "instance"))
        boxes, found, outlines = visible_movers(mask, instance, names)
        numbers = np.array([classes.index(name) for name in found], int)
        samples.append(Sample(file, boxes, numbers, np.zeros(len(boxes), bool), outlines))
    return samples


def coco_samples(root, split):
    """Samples of COCO: `root`/annotations/instances_`split`.json with the images in `root`/`split` or
    `root`/images/`split`. Classes are numbered from 0 in the order of the categories' ids.

    @return samples, class names
    """
    content = json.loads((root / f"annotations/instances_{split}.json").read_text(encoding="utf-8"))
    images = root / split if (root / split).is_dir() else root / "images" / split
    categories = sorted(content["categories"], key=lambda category: category["id"])
    index = {category["id"]: i for i, category in enumerate(categories)}
    objects = {image["id"]: [] for image in content["images"]}
    for annotation in content["annotations"]:
        if min(annotation["bbox"][2:]) > 0:
            objects[annotation["image_id"]].append(annotation)
    samples = []
    for image in content["images"]:
        found = objects[image["id"]]
        boxes = np.array([a["bbox"] for a in found], float).reshape(-1, 4)
        boxes[:, 2:] += boxes[:, :2]
        crowd = np.array([a.get("iscrowd", 0) for a in found], bool)
        # The outline of a crowd is run-length encoded, and not used.
        outlines = [None if c or not a.get("segmentation") else largest(a["segmentation"])
                    for a, c in zip(found, crowd)]
        classes = np.array([index[a["category_id"]] for a in found], int)
        samples.append(Sample(images / image["file_name"], boxes, classes, crowd, outlines))
    return samples, [category["name"] for category in categories]


def samples_of(source, split):
    """Samples and class names for read_samples(), with the class numbers of the data."""
    source = Path(source)
    if (source / "annotations").is_dir():
        return coco_samples(source, f"{split}2017")
    sequences = [folder for folder in sorted(source.glob("*")) if (folder / "instance").is_dir()]
    folders = [folder for folder in sequences if folder.name.startswith(split)]
    if not folders:
        raise SystemExit(f"{source}: neither COCO (annotations/) nor simulated sequences named {split}*; "
                         f"fix: stillmap simulate --out {source}/{split}_1")
    classes = class_names(sequences)
    return [sample for folder in folders for sample in simulated_samples(folder, classes)], classes


def read_samples(source, split, names=None):
    """Samples and class names of a COCO root, or of a folder of simulated sequences.

    @param split  train or val. Of COCO: train2017 or val2017. Of simulated sequences: the folders named `split`*.
    @param names  class names of a network, whose order numbers the classes; None: the order of the data
    """
    samples, found = samples_of(source, split)
    if names is None:
        return samples, found
    unknown = [name for name in found if name not in names]
    if unknown:
        raise SystemExit(f"{source}: has {', '.join(unknown)}, but the network knows only {', '.join(names)}")
    for sample in samples:
        sample.classes = np.array([names.index(found[number]) for number in sample.classes], int)
    return samples, names


def change_colors(image, generator, strength):
    """Random factors of hue, saturation and value; with strength 1 the ranges are those of YOLOv7."""
    gains = 1 + strength * np.array([0.015, 0.7, 0.4]) * [generator.uniform(-1, 1) for _ in range(3)]
    hsv = cv2.cvtColor(image, cv2.COLOR_BGR2HSV).astype(np.float32) * gains
    hsv[..., 0] %= 180
    return cv2.cvtColor(hsv.clip(0, 255).astype(np.uint8), cv2.COLOR_HSV2BGR)


def keep_inside(boxes, classes, shape, min_share=0.2):
    """Clips boxes to the image; drops those with less than `min_share` of their area or 4 pixels left."""
    size = np.array([shape[1], shape[0]] * 2)
    clipped = boxes.clip(0, size)
    sides, full = clipped[:, 2:] - clipped[:, :2], boxes[:, 2:] - boxes[:, :2]
    good = (sides.min(1) > 4) & (sides.prod(1) > min_share * full.prod(1)) if len(boxes) else np.zeros(0, bool)
    return clipped[good], classes[good]


class ImageDataset(Dataset):
    """Samples as network inputs.

    @param size     (height, width) of the input [pixels]
    @param augment  mosaics of four images, scale, translation, color and flip, as YOLOv7; else the plain letterbox
    @param cache    keeps the scaled images in memory
    @param mosaic   share of mosaics [0..1]
    @param strength factor on the ranges of scale, translation and color [0..1]
    """

    def __init__(self, samples, size, augment=False, cache=False, mosaic=1.0, strength=1.0):
        self.samples, self.size, self.augment = samples, size, augment
        self.cache, self.mosaic, self.strength = {} if cache else None, mosaic, strength
        self.scale, self.translation = 0.5 * strength, 0.2 * strength
        self.generator = random.Random(1)

    def __len__(self):
        return len(self.samples)

    def scaled(self, i):
        """Returns a sample's image scaled to fit the input, its boxes and classes, without padding."""
        if self.cache is not None and i in self.cache:
            return self.cache[i]
        sample = self.samples[i]
        image = cv2.imread(str(sample.file))
        if image is None:
            raise SystemExit(f"{sample.file}: not a readable image")
        place = Letterbox(image.shape[:2], self.size)
        (top, left), (height, width) = place.pad, place.inner
        inner = place.fill(image)[top:top + height, left:left + width]
        boxes = place.to_input(sample.boxes) - [left, top, left, top]
        result = inner, boxes[~sample.crowd], sample.classes[~sample.crowd]
        if self.cache is not None:
            self.cache[i] = result
        return result

    def placed(self, image, boxes, scale, x, y, canvas):
        """Draws the scaled image with its corner at (x, y); returns its boxes there."""
        matrix = np.array([[scale, 0, x], [0, scale, y]], float)
        matrix[:, 2] += (scale - 1) / 2  # warpAffine has pixel centers at integers
        cv2.warpAffine(image, matrix, canvas.shape[1::-1], canvas, cv2.INTER_LINEAR, cv2.BORDER_TRANSPARENT)
        return boxes * scale + [x, y, x, y]

    def mosaic_of(self, i):
        """Four images around a random center, each in its quarter."""
        height, width = self.size
        random_number = self.generator.uniform
        center = int(width * random_number(0.3, 0.7)), int(height * random_number(0.3, 0.7))
        image = np.full((height, width, 3), GRAY, np.uint8)
        all_boxes, all_classes = [], []
        for quarter in range(4):
            source, boxes, classes = self.scaled(i if quarter == 0 else self.generator.randrange(len(self)))
            left, top = quarter % 2 == 0, quarter < 2
            x0, x1 = (0, center[0]) if left else (center[0], width)
            y0, y1 = (0, center[1]) if top else (center[1], height)
            scale = random_number(1 - self.scale, 1 + self.scale)
            # The corner of the image that lies at the center of the mosaic, moved by up to a tenth of its size.
            h, w = source.shape[0] * scale, source.shape[1] * scale
            x = (x1 - x0 - w if left else 0) + random_number(-0.1, 0.1) * w
            y = (y1 - y0 - h if top else 0) + random_number(-0.1, 0.1) * h
            part = image[y0:y1, x0:x1].copy()
            boxes, classes = keep_inside(self.placed(source, boxes, scale, x, y, part), classes, part.shape)
            image[y0:y1, x0:x1] = part
            all_boxes.append(boxes + [x0, y0, x0, y0])
            all_classes.append(classes)
        return image, np.concatenate(all_boxes), np.concatenate(all_classes)

    def single(self, i):
        """One image with random scale and translation."""
        height, width = self.size
        source, boxes, classes = self.scaled(i)
        scale = self.generator.uniform(1 - self.scale, 1 + self.scale) if self.augment else 1.0
        x, y = (width - source.shape[1] * scale) // 2, (height - source.shape[0] * scale) // 2
        if self.augment:
            x += self.generator.uniform(-1, 1) * self.translation * width
            y += self.generator.uniform(-1, 1) * self.translation * height
        image = np.full((height, width, 3), GRAY, np.uint8)
        boxes = self.placed(source, boxes, scale, x, y, image)
        return image, *keep_inside(boxes, classes, image.shape)

    def __getitem__(self, i):
        mosaic = self.augment and self.generator.random() < self.mosaic
        image, boxes, classes = self.mosaic_of(i) if mosaic else self.single(i)
        if self.augment:
            image = change_colors(image, self.generator, self.strength)
            if self.generator.random() < 0.5:
                image = image[:, ::-1]
                boxes = boxes[:, [2, 1, 0, 3]] * [-1, 1, -1, 1] + [self.size[1], 0, self.size[1], 0]
        return np.ascontiguousarray(image), boxes, classes


def collate(batch):
    """Returns the images as one tensor, and per image its boxes and classes."""
    images, boxes, classes = zip(*batch)
    targets = [(torch.from_numpy(b).float(), torch.from_numpy(c).long()) for b, c in zip(boxes, classes)]
    return to_tensor(np.stack(images)), targets


def seed_worker(number):
    """Gives each loader process its own random numbers."""
    torch.utils.data.get_worker_info().dataset.generator = random.Random(1000 + number + torch.initial_seed() % 2 ** 31)
