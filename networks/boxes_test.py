# SPDX-License-Identifier: Apache-2.0
"""Boxes, their decoding and the loss, compared with closed forms."""
import numpy as np
import pytest
import torch

from networks import boxes
from networks.loss import Loss, candidate_mask
from networks.yolov7 import YOLOv7


def test_overlap_of_two_squares():
    a, b = torch.tensor([0.0, 0, 2, 2]), torch.tensor([1.0, 1, 3, 3])
    iou, union = boxes.overlaps(a, b)
    assert iou == pytest.approx(1 / 7) and union == 7


def test_complete_iou_of_shifted_and_of_stretched_boxes():
    a = torch.tensor([0.0, 0, 2, 2])
    assert boxes.complete_iou(a, a) == pytest.approx(1, abs=1e-6)
    # Equal aspect ratios: 1/7 less the squared distance of the centers, 2, over that of the hull's diagonal, 18.
    assert boxes.complete_iou(a, a + 1) == pytest.approx(1 / 7 - 2 / 18, abs=1e-6)
    wide = torch.tensor([-1.0, 0, 3, 2])  # same center, twice as wide
    v = 4 / np.pi ** 2 * (np.arctan(2) - np.arctan(1)) ** 2
    assert boxes.complete_iou(a, wide) == pytest.approx(0.5 - v * v / (0.5 + v), abs=1e-5)


def test_zero_logits_give_the_anchor_box_in_the_center_of_its_cell():
    grid = boxes.AnchorGrid(64, 96)
    decoded = grid.centered_boxes(torch.zeros(len(grid.stride), 4))
    number = 8 * 12 + 3 * 12 + 5  # head of stride 8, second anchor box, row 3, column 5
    assert decoded[number].tolist() == [5.5 * 8, 3.5 * 8, 19, 36]
    assert decoded[-1].tolist() == [2.5 * 32, 1.5 * 32, 459, 401]


def test_a_less_confident_box_is_dropped_only_within_its_class():
    b = torch.tensor([[0.0, 0, 10, 10], [1, 0, 11, 10], [0, 0, 10, 10], [50, 50, 60, 60]])
    kept = boxes.suppress_overlaps(b, torch.tensor([0.5, 0.9, 0.4, 0.3]), torch.tensor([0, 0, 1, 0]), 0.7, 100)
    assert kept.tolist() == [1, 2, 3]


def test_letterbox_moves_boxes_to_the_input_and_back():
    place = boxes.Letterbox((480, 640), (256, 320))
    assert place.inner == (240, 320) and place.pad == (8, 0)
    corners = np.array([[0.0, 0, 640, 480]])
    assert place.to_input(corners).tolist() == [[0, 8, 320, 248]]
    assert place.to_image(place.to_input(corners)).tolist() == corners.tolist()
    image = place.fill(np.zeros((480, 640, 3), np.uint8))
    assert image[7, 0, 0] == boxes.GRAY and image[8, 0, 0] == 0


def test_candidates_are_the_cell_of_the_center_and_its_two_nearest_neighbors():
    grid = boxes.AnchorGrid(64, 64)
    box = torch.tensor([[30.0, 22, 42, 38]])  # 12 x 16 around (36, 30): cell (4, 3) of stride 8, in its lower half
    found = candidate_mask(grid, box + torch.tensor([1.0, 0, 1, 0]))[0].nonzero()[:, 0]  # and in its right half
    cells = {tuple(grid.cell[i].tolist()) for i in found if grid.stride[i] == 8}
    assert cells == {(4, 3), (5, 3), (4, 4)}
    too_large = {(192.0, 243.0), (459.0, 401.0)}  # by more than a factor of four
    assert not too_large & {tuple(grid.size[i].tolist()) for i in found}


def heads_for(classes, size):
    return [torch.full((1, 3, size // s, size // s, 5 + classes), -4.0) for s in (8, 16, 32)]


def test_a_right_box_costs_less_than_a_shifted_one():
    target = [(torch.tensor([[30.5, 20.0, 42.5, 36.0]]), torch.tensor([1]))]  # center (36.5, 28)
    costs = []
    for shift in (0.0, 1.0):
        heads = heads_for(2, 64)
        heads[0][0, 0, 3, 4] = torch.tensor([0.125 + shift, 0, 0, 0, 4, -4, 4])  # first anchor box: 12 x 16
        loss, _ = Loss(2, 64, 64)(heads, target)
        costs.append(float(loss))
    assert costs[0] < costs[1]


def test_without_objects_only_objectness_costs():
    _, parts = Loss(2, 64, 64)(heads_for(2, 64), [(torch.zeros(0, 4), torch.zeros(0, dtype=torch.long))])
    assert parts[0] == parts[2] == 0
    expected = 0.7 * (4 + 1 + 0.4) * np.log1p(np.exp(-4))
    assert parts[1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("improved", [False, True])
def test_a_small_network_learns_one_image(improved):
    torch.manual_seed(1)
    network = YOLOv7(1, improved, improved, width=0.125).train()
    image = torch.zeros(2, 3, 96, 96)
    image[0, :, 20:60, 30:50] = 1
    image[1, 0, 40:80, 50:90] = 1
    targets = [(torch.tensor([box]), torch.tensor([0])) for box in ([30.0, 20, 50, 60], [50.0, 40, 90, 80])]
    loss, optimizer = Loss(1, 96, 96), torch.optim.Adam(network.parameters(), 3e-3)
    history = []
    for _ in range(80):
        optimizer.zero_grad()
        value, parts = loss(network(image), targets)
        value.backward()
        optimizer.step()
        history.append(parts[0])
    assert np.mean(history[-5:]) < 0.5 * np.mean(history[:5])
