# SPDX-License-Identifier: Apache-2.0
"""The loss of YOLOv7 and its assignment of anchors to objects.

Candidates of an object are the anchors of its cell and of the two nearest neighbor cells whose size differs by less
than a factor of 4 (YOLOv5). Of these, dynamic-k selection keeps the cheapest ones (SimOTA; Ge et al., YOLOX,
2021). The box loss is one less CIoU.
The objectness is trained towards the IoU of the predicted box.
"""
import torch
from torch.nn import functional as F

from networks.boxes import AnchorGrid, complete_iou, flatten_heads, overlaps, to_corners

MAX_SIZE_RATIO = 4.0
TOP_IOUS = 10  # dynamic k: sum of that many best IoUs
IOU_COST = 3.0  # weight of the IoU in the cost of an assignment
# Of YOLOv7, for 80 classes and 640x640. YOLOv7 also scales the objectness by the area of the image; with small images
# the objectness then hardly learns.
BOX_GAIN, OBJECTNESS_GAIN, CLASS_GAIN = 0.05, 0.7, 0.3
HEAD_BALANCE = (4.0, 1.0, 0.4)  # of the objectness


def candidate_mask(grid, boxes):
    """Returns [objects, anchors]: which anchors may predict which object."""
    center, size = (boxes[:, :2] + boxes[:, 2:]) / 2, boxes[:, 2:] - boxes[:, :2]
    ratio = size[:, None] / grid.size
    fits = torch.maximum(ratio, 1 / ratio).amax(-1) < MAX_SIZE_RATIO
    offset = (center[:, None] / grid.stride - grid.cell - 0.5).abs()  # from the center of the cell [cells]
    near = (offset.amin(-1) < 0.5) & (offset.amax(-1) < 1)
    return fits & near


def assign(raw, corners, candidates, boxes, classes):
    """Chooses the anchors of each object in one image.

    @param raw         predictions [anchors, 5 + classes], logits
    @param corners     predicted boxes [anchors, 4]
    @param candidates  see candidate_mask()
    @return anchors and objects, index pairs
    """
    anchors = candidates.any(0).nonzero()[:, 0]
    if not len(anchors):
        return anchors, anchors
    allowed = candidates[:, anchors]
    iou, _ = overlaps(boxes[:, None], corners[anchors])
    probability = (torch.sigmoid(raw[anchors, 5:]) * torch.sigmoid(raw[anchors, 4:5])).sqrt()
    wanted = F.one_hot(classes, raw.shape[1] - 5).float()
    shape = (len(boxes), len(anchors), wanted.shape[1])
    class_cost = F.binary_cross_entropy(probability.expand(shape), wanted[:, None].expand(shape),
                                        reduction="none").sum(-1)
    cost = class_cost - IOU_COST * torch.log(iou + 1e-8)
    cost[~allowed] = torch.inf
    k = (iou * allowed).topk(min(TOP_IOUS, len(anchors)), 1).values.sum(1).int().clamp(1)
    rank = cost.argsort(1).argsort(1)
    chosen = (rank < k[:, None]) & allowed
    cheapest = torch.where(chosen, cost, torch.inf).argmin(0)  # an anchor serves one object
    used = chosen.any(0).nonzero()[:, 0]
    return anchors[used], cheapest[used]


class Loss:
    """Weighted sum of box, objectness and class loss of a batch.

    @param height, width  size of the network's input [pixels]
    """

    def __init__(self, classes, height, width, device="cpu"):
        self.classes, self.grid = classes, AnchorGrid(height, width).to(device)
        self.class_gain = CLASS_GAIN * classes / 80

    def assign_batch(self, raw, corners, targets):
        """Returns image and anchor of all assignments, and their true boxes and classes."""
        rows = []
        for image, (boxes, classes) in enumerate(targets):
            if len(boxes):
                mask = candidate_mask(self.grid, boxes)
                anchors, objects = assign(raw[image], corners[image], mask, boxes, classes)
                rows.append((torch.full_like(anchors, image), anchors, boxes[objects], classes[objects]))
        return [torch.cat(column) for column in zip(*rows)] if rows else None

    def __call__(self, heads, targets):
        """@param targets  per image: boxes [n, 4] in input pixels, and classes [n]
        @return the loss and its three parts, the parts as numbers"""
        raw = flatten_heads(heads).float()
        corners = to_corners(self.grid.centered_boxes(raw[..., :4]))
        wanted_objectness = torch.zeros_like(raw[..., 4])
        box_loss = class_loss = raw.sum() * 0
        with torch.no_grad():
            assigned = self.assign_batch(raw, corners, targets)
        if assigned:
            image, anchor, boxes, classes = assigned
            similarity = complete_iou(corners[image, anchor], boxes)
            wanted_objectness[image, anchor] = similarity.detach().clamp(0)
            box_loss = (1 - similarity).mean()
            class_loss = F.binary_cross_entropy_with_logits(raw[image, anchor, 5:],
                                                            F.one_hot(classes, self.classes).float())
        objectness = F.binary_cross_entropy_with_logits(raw[..., 4], wanted_objectness, reduction="none")
        per_head = [part.mean() for part in objectness.split(self.grid.counts, 1)]
        objectness_loss = sum(weight * part for weight, part in zip(HEAD_BALANCE, per_head))
        parts = [3 * BOX_GAIN * box_loss, OBJECTNESS_GAIN * objectness_loss, 3 * self.class_gain * class_loss]
        return sum(parts), [float(part.detach()) for part in parts]
