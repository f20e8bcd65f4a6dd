# SPDX-License-Identifier: Apache-2.0
"""Mean average precision of a trained network by pycocotools.

  python -m networks.evaluate best.pt COCO_ROOT                    # val2017
  python -m networks.evaluate best.pt SEQUENCES --size 256 320     # the sequences val* of `stillmap simulate`
"""
import argparse
import contextlib
import io
import json
from pathlib import Path

import cv2
import numpy as np
import torch
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from networks import yolov7
from networks.boxes import Decoded, Letterbox, detections, to_tensor
from networks.data import ImageDataset, read_samples

CONFIDENCE, IOU, MOST = 0.001, 0.65, 300  # of YOLOv7's evaluation


def truth_of(samples, names):
    """Returns the true boxes as a COCO object."""
    annotations = []
    for image, sample in enumerate(samples):
        for (x0, y0, x1, y1), category, crowd in zip(sample.boxes.tolist(), sample.classes, sample.crowd):
            annotations.append({"id": len(annotations) + 1, "image_id": image, "category_id": int(category),
                                "bbox": [x0, y0, x1 - x0, y1 - y0], "area": (x1 - x0) * (y1 - y0),
                                "iscrowd": int(crowd)})
    truth = COCO()
    truth.dataset = {"info": {}, "images": [{"id": image} for image in range(len(samples))], "annotations": annotations,
                     "categories": [{"id": i, "name": name} for i, name in enumerate(names)]}
    with contextlib.redirect_stdout(io.StringIO()):
        truth.createIndex()
    return truth


@torch.no_grad()
def results_of(network, samples, size, device, batch=16):
    """Returns the detections in COCO's format of results, in image pixels."""
    decoder = Decoded(network, *size).eval().to(device)
    decoder.grid.to(device)
    dataset, results = ImageDataset(samples, size), []
    for first in range(0, len(samples), batch):
        numbers = range(first, min(first + batch, len(samples)))
        decoded = decoder(to_tensor(np.stack([dataset[i][0] for i in numbers])).to(device)).cpu()
        for number, output in zip(numbers, decoded):
            place = Letterbox(cv2.imread(str(samples[number].file)).shape[:2], size)
            boxes, scores, classes = detections(output, CONFIDENCE, IOU, MOST)
            for (x0, y0, x1, y1), score, category in zip(place.to_image(boxes.numpy()).tolist(), scores, classes):
                results.append({"image_id": number, "category_id": int(category), "score": float(score),
                                "bbox": [x0, y0, x1 - x0, y1 - y0]})
    return results


def average_precision(truth, results):
    """Returns mAP over IoU 0.5 to 0.95 and at 0.5, and AP over IoU 0.5 to 0.95 of each class in the truth, [0..1]."""
    shown = {number: category["name"] for number, category in truth.cats.items() if truth.getAnnIds(catIds=[number])}
    if not results:
        return {"map": 0.0, "map50": 0.0, "classes": dict.fromkeys(shown.values(), 0.0)}
    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = COCOeval(truth, truth.loadRes(results), "bbox")
        evaluation.evaluate()
        evaluation.accumulate()
        evaluation.summarize()
    precisions = evaluation.eval["precision"][:, :, :, 0, -1].mean((0, 1))  # per class, for all areas
    of_class = dict(zip(evaluation.params.catIds, precisions.tolist()))
    return {"map": float(evaluation.stats[0]), "map50": float(evaluation.stats[1]),
            "classes": {name: of_class[number] for number, name in shown.items()}}


def precision_and_recall(truth, results, confidence=0.25, iou=0.5):
    """Returns precision and recall over all classes at one confidence, by pycocotools' matching."""
    sure = [result for result in results if result["score"] >= confidence]
    if not sure:
        return {"precision": 0.0, "recall": 0.0}
    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = COCOeval(truth, truth.loadRes(sure), "bbox")
        evaluation.params.iouThrs, evaluation.params.areaRng = np.array([iou]), [[0, 1e10]]
        evaluation.params.areaRngLbl = ["all"]
        evaluation.evaluate()
    images = [image for image in evaluation.evalImgs if image]
    hits = sum(int((image["dtMatches"][0] > 0).sum()) for image in images)
    found = sum(int((~image["dtIgnore"][0].astype(bool)).sum()) for image in images)
    true = sum(int((~np.array(image["gtIgnore"], bool)).sum()) for image in images)
    return {"precision": hits / max(found, 1), "recall": hits / max(true, 1)}


def evaluate(network, names, samples, size, device="cpu"):
    """Returns mAP over IoU 0.5 to 0.95, mAP at IoU 0.5, and precision and recall at confidence 0.25 and IoU 0.5."""
    truth, results = truth_of(samples, names), results_of(network, samples, size, device)
    return average_precision(truth, results) | precision_and_recall(truth, results)


def main(words=None):
    parser = argparse.ArgumentParser(prog="python -m networks.evaluate", description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--size", type=int, nargs=2, default=[640, 640], metavar=("HEIGHT", "WIDTH"))
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    settings = parser.parse_args(words)
    network, names = yolov7.load(settings.weights)
    samples, _ = read_samples(settings.data, settings.split, names)
    print(json.dumps(evaluate(network, names, samples, settings.size, settings.device)))


if __name__ == "__main__":
    main()
