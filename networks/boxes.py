# SPDX-License-Identifier: Apache-2.0
"""Boxes of the network: letterbox, decoding of the heads, overlap measures, non-maximum suppression.

Boxes are corners (x0, y0, x1, y1) in edge coordinates [pixels of the network's input], unless stated. The same steps in
C++: stillmap/segment/letterbox.cpp and yolo_decoder.cpp.
"""
import math

import cv2
import numpy as np
import torch

from networks.yolov7 import ANCHORS, STRIDES

GRAY = 114  # padding value that YOLO networks are trained with


class Letterbox:
    """Placement of an image in a network's input: scaled with constant aspect ratio, centered, the rest gray."""

    def __init__(self, image_size, input_size):
        """@param image_size, input_size  (height, width) [pixels]"""
        self.image, self.input = image_size, input_size
        scale = min(input_size[0] / image_size[0], input_size[1] / image_size[1])
        self.inner = tuple(min(max(round(n * scale), 1), limit) for n, limit in zip(image_size, input_size))
        self.pad = tuple((limit - n) // 2 for n, limit in zip(self.inner, input_size))

    def fill(self, image):
        """Returns the 8-bit image [height, width, 3], scaled and padded to the size of the input."""
        method = cv2.INTER_AREA if self.inner[1] < self.image[1] else cv2.INTER_LINEAR
        canvas = np.full((*self.input, 3), GRAY, np.uint8)
        (top, left), (height, width) = self.pad, self.inner
        canvas[top:top + height, left:left + width] = cv2.resize(image, (width, height), interpolation=method)
        return canvas

    def factors(self):
        scale = np.array([self.inner[1] / self.image[1], self.inner[0] / self.image[0]] * 2)
        return scale, np.array([self.pad[1], self.pad[0]] * 2)

    def to_input(self, boxes):
        scale, pad = self.factors()
        return boxes * scale + pad

    def to_image(self, boxes):
        scale, pad = self.factors()
        return (boxes - pad) / scale


def to_tensor(images):
    """Returns 8-bit BGR images [batch, height, width, 3] as a float tensor [batch, 3, height, width], RGB, 0 to 1."""
    return torch.from_numpy(np.ascontiguousarray(images[..., ::-1].transpose(0, 3, 1, 2))).float() / 255


class AnchorGrid:
    """Cell, stride and anchor box of every anchor of an input size, in the order head, anchor box, row, column."""

    def __init__(self, height, width):
        cells, strides, sizes, self.counts = [], [], [], []
        for stride, anchors in zip(STRIDES, ANCHORS):
            rows, columns = torch.meshgrid(torch.arange(height // stride), torch.arange(width // stride), indexing="ij")
            cell = torch.stack([columns, rows], -1).float().reshape(-1, 2)
            self.counts.append(3 * len(cell))
            cells.append(cell.repeat(3, 1))
            strides.append(torch.full((3 * len(cell), 1), float(stride)))
            sizes.append(torch.tensor(anchors).float().repeat_interleave(len(cell), 0))
        self.cell, self.stride, self.size = torch.cat(cells), torch.cat(strides), torch.cat(sizes)

    def to(self, device):
        self.cell, self.stride, self.size = (t.to(device) for t in (self.cell, self.stride, self.size))
        return self

    def centered_boxes(self, raw):
        """Decodes logits [..., anchors, 4] to center x, y, width, height [pixels] with the box equations of YOLOv5,
        which YOLOv7 uses: x = (2 s(t_x) - 0.5 + column) stride, w = (2 s(t_w))^2 a, with the logistic function s."""
        s = torch.sigmoid(raw)
        center = (2 * s[..., :2] - 0.5 + self.cell) * self.stride
        return torch.cat([center, (2 * s[..., 2:4]) ** 2 * self.size], -1)


def flatten_heads(heads):
    """Returns the heads as one tensor [batch, anchors, 5 + classes], in the order of AnchorGrid."""
    return torch.cat([h.reshape(h.shape[0], -1, h.shape[-1]) for h in heads], 1)


def to_corners(centered):
    half = centered[..., 2:4] / 2
    return torch.cat([centered[..., :2] - half, centered[..., :2] + half], -1)


def overlaps(a, b):
    """Returns intersection over union, and the area of the union, of broadcastable boxes [..., 4]."""
    shared = (torch.minimum(a[..., 2:], b[..., 2:]) - torch.maximum(a[..., :2], b[..., :2])).clamp(0).prod(-1)
    union = (a[..., 2:] - a[..., :2]).prod(-1) + (b[..., 2:] - b[..., :2]).prod(-1) - shared
    return shared / union.clamp(1e-9), union


def complete_iou(a, b):
    """Returns CIoU (Zheng et al., 2020): IoU less the normalized center distance and a difference of aspect ratios."""
    iou, _ = overlaps(a, b)
    hull = torch.maximum(a[..., 2:], b[..., 2:]) - torch.minimum(a[..., :2], b[..., :2])
    distance = ((a[..., :2] + a[..., 2:] - b[..., :2] - b[..., 2:]) ** 2).sum(-1) / 4
    (wa, ha), (wb, hb) = ((c[..., 2:] - c[..., :2]).clamp(1e-7).unbind(-1) for c in (a, b))
    v = 4 / math.pi ** 2 * (torch.atan(wb / hb) - torch.atan(wa / ha)) ** 2
    with torch.no_grad():
        alpha = v / (1 - iou + v + 1e-7)
    return iou - distance / ((hull ** 2).sum(-1) + 1e-7) - alpha * v


def suppress_overlaps(boxes, scores, classes, iou, most):
    """Greedy non-maximum suppression within each class. Returns the indices kept, by descending score."""
    order = torch.sort(scores, descending=True, stable=True).indices
    kept = []
    while len(order) and len(kept) < most:
        best, order = order[0], order[1:]
        kept.append(best)
        covered = (overlaps(boxes[best], boxes[order])[0] > iou) & (classes[order] == classes[best])
        order = order[~covered]
    return torch.stack(kept) if kept else order


def detections(decoded, confidence=0.25, iou=0.7, most=100):
    """Detections of one image from its decoded output [anchors, 5 + classes] (see Decoded).

    @return boxes [n, 4], scores [n] and classes [n], by descending score
    """
    scores, classes = decoded[:, 5:].max(1)
    scores = scores * decoded[:, 4]
    sure = scores >= confidence
    boxes, scores, classes = to_corners(decoded[sure, :4]), scores[sure], classes[sure]
    kept = suppress_overlaps(boxes, scores, classes, iou, most)
    return boxes[kept], scores[kept], classes[kept]


class Decoded(torch.nn.Module):
    """A network with its decoder: [batch, anchors, 5 + classes] with x, y, w, h [pixels], objectness and class scores
    [0..1]: the layout of YOLOv7's export "with grid"."""

    def __init__(self, network, height, width):
        super().__init__()
        self.network, self.grid = network, AnchorGrid(height, width)

    def forward(self, images):
        raw = flatten_heads(self.network(images))
        return torch.cat([self.grid.centered_boxes(raw[..., :4]), torch.sigmoid(raw[..., 4:])], -1)
