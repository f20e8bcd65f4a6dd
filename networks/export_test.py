# SPDX-License-Identifier: Apache-2.0
"""The exported network in the C++ decoder: the same boxes as PyTorch's. Skipped without stillmap_lab (agreement.py)."""
import os
from pathlib import Path

import cv2
import numpy as np
import onnx
import pytest
import torch

from networks import count
from networks.agreement import LAB, decode_by_pytorch, largest_difference, rows_of_pytorch, rows_of_stillmap
from networks.export import export
from networks.network_test import with_random_statistics
from networks.yolov7 import YOLOv7

SIZE = (96, 128)
NAMES = ["person", "dog", "chair"]
TOLERANCE = 1e-3  # [pixels]
MODELS = Path(os.environ.get("STILLMAP_SHARED", Path(__file__).parent.parent.parent / "shared")) / "models"


@pytest.fixture(scope="module")
def network():
    """A network with random weights, enlarged so that its outputs differ from cell to cell."""
    torch.manual_seed(3)
    network = with_random_statistics(YOLOv7(len(NAMES), ghost=True, attention=True, width=0.125))
    for head in network.out:
        head.conv.weight.data *= 4
        head.conv.bias.data.zero_()
    return network


@pytest.fixture(scope="module")
def image():
    noise = np.random.default_rng(4).integers(0, 256, (12, 16, 3), dtype=np.uint8)
    return cv2.resize(noise, (256, 160), interpolation=cv2.INTER_CUBIC)


def confidence_of_forty(network, image):
    """Returns a confidence that 40 candidates of the image reach."""
    decoded, _ = decode_by_pytorch(network, image, SIZE)
    scores = torch.sort(decoded[:, 4] * decoded[:, 5:].max(1).values, descending=True).values
    return float(scores[39] + scores[40]) / 2


@pytest.mark.parametrize("raw, shapes", [(False, [[1, 756, 8]]),
                                         (True, [[1, 3, 12, 16, 8], [1, 3, 6, 8, 8], [1, 3, 3, 4, 8]])])
def test_the_file_has_the_layout_of_yolov7(network, tmp_path, raw, shapes):
    export(network, NAMES, SIZE, tmp_path / "a.onnx", raw)
    model = onnx.load(tmp_path / "a.onnx")
    assert [[d.dim_value for d in output.type.tensor_type.shape.dim] for output in model.graph.output] == shapes
    assert {p.key: p.value for p in model.metadata_props}["names"] == "{0: 'person', 1: 'dog', 2: 'chair'}"


def test_the_file_has_the_parameters_and_operations_of_the_network(network, tmp_path):
    export(network, NAMES, SIZE, tmp_path / "a.onnx", raw=True)
    parameters, operations = count.count_onnx(tmp_path / "a.onnx", *SIZE)
    deployed = network.deployed()
    assert parameters == count.parameters(deployed)
    assert operations == pytest.approx(count.gflops(deployed, *SIZE), rel=1e-6)
    assert count.count_onnx(tmp_path / "a.onnx", 2 * SIZE[0], SIZE[1])[1] == pytest.approx(2 * operations)


@pytest.mark.parametrize("file, parameters, operations", [
    ("yolo11n_480x640.onnx", 2_616_248, 6.5),  # "2.6" million and "6.5" GFLOPs in table 1 of Feng et al. 2026
    ("yolov8n-seg_480x640.onnx", 3_404_320, 12.0)])
def test_the_networks_of_ultralytics_have_their_parameters_and_operations(file, parameters, operations):
    if not (MODELS / file).exists():
        pytest.skip(f"no {MODELS / file}")
    counted = count.count_onnx(MODELS / file)
    assert counted == (parameters, pytest.approx(operations, abs=0.05))


@pytest.mark.skipif(not LAB.exists(), reason=f"{LAB} is not built")
@pytest.mark.parametrize("raw", [False, True])
@pytest.mark.parametrize("backend", ["auto", "opencv"])
def test_stillmap_finds_the_boxes_of_pytorch(network, image, tmp_path, raw, backend):
    export(network, NAMES, SIZE, tmp_path / "a.onnx", raw)
    cv2.imwrite(str(tmp_path / "a.png"), image)
    confidence = confidence_of_forty(network, image)
    expected = rows_of_pytorch(network, image, SIZE, confidence)
    found = rows_of_stillmap(tmp_path / "a.onnx", NAMES, tmp_path / "a.png", confidence, backend)
    assert len(expected) >= 5
    of_confidence, of_corner = largest_difference(found, expected)
    assert of_confidence < 1e-4 and of_corner < TOLERANCE


def test_other_detections_differ_infinitely():
    a = np.array([[0, 0.9, 1, 1, 5, 5], [1, 0.8, 2, 2, 7, 7]])
    assert largest_difference(a[::-1], a) == (0, 0)  # the order is of no importance
    assert largest_difference(a[:1], a) == (np.inf, np.inf)
    assert largest_difference(a[[0, 0]], a) == (np.inf, np.inf)
    other_class = a * [0, 1, 1, 1, 1, 1]
    assert largest_difference(other_class, a) == (np.inf, np.inf)
