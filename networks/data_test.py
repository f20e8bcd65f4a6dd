# SPDX-License-Identifier: Apache-2.0
"""Reading of COCO and of simulated sequences, augmentation, mAP, and training by the command line."""
import json
import sys
import types

import cv2
import numpy as np
import pytest
import torch

from networks import evaluate, export, fine_tune, train
from networks.data import ImageDataset, read_samples

BOXES = {0: (20, 10, 60, 70), 1: (70, 30, 110, 90)}  # of the person in the sequences


def write_sequence(folder, frames=4):
    """A sequence in the layout of `stillmap simulate`: a bright person before a dark wall, and a moving object."""
    for kind in ("rgb", "mask", "instance"):
        (folder / kind).mkdir(parents=True)
    for frame in range(frames):
        x0, y0, x1, y1 = BOXES[frame % 2]
        rgb, mask, instance = np.full((96, 128, 3), 40, np.uint8), *np.zeros((2, 96, 128), np.uint8)
        rgb[y0:y1, x0:x1], mask[y0:y1, x0:x1], instance[y0:y1, x0:x1] = (255, 255, 255), 255, 3
        mask[:8, :20], instance[:8, :20] = 128, 5
        for kind, image in (("rgb", rgb), ("mask", mask), ("instance", instance)):
            cv2.imwrite(str(folder / kind / f"{frame / 30:.6f}.png"), image)


@pytest.fixture
def sequences(tmp_path):
    for split in ("train_1", "val_1"):
        write_sequence(tmp_path / "sequences" / split)
    return tmp_path / "sequences"


@pytest.fixture
def coco(tmp_path):
    root = tmp_path / "coco"
    (root / "annotations").mkdir(parents=True)
    (root / "train2017").mkdir()
    cv2.imwrite(str(root / "train2017/7.jpg"), np.zeros((50, 80, 3), np.uint8))
    (root / "annotations/instances_train2017.json").write_text(json.dumps({
        "images": [{"id": 7, "file_name": "7.jpg"}],
        "categories": [{"id": 18, "name": "dog"}, {"id": 1, "name": "person"}],
        "annotations": [{"image_id": 7, "bbox": [10, 5, 20, 30], "category_id": 18, "iscrowd": 0,
                         "segmentation": [[10, 5, 30, 5, 30, 35], [10, 5, 11, 5, 11, 6]]},
                        {"image_id": 7, "bbox": [0, 0, 80, 50], "category_id": 1, "iscrowd": 1, "segmentation": {}},
                        {"image_id": 7, "bbox": [3, 3, 0, 5], "category_id": 1}]}), encoding="utf-8")
    return root


def test_boxes_of_a_simulated_sequence_are_those_of_its_people(sequences):
    samples, names = read_samples(sequences, "train")
    assert names == ["person"]
    assert [tuple(sample.boxes[0]) for sample in samples] == [BOXES[i % 2] for i in range(4)]
    assert all(len(sample.boxes) == 1 for sample in samples)  # not the moving object


def test_classes_of_a_simulated_sequence_are_those_of_its_movers(sequences):
    (sequences / "val_1/truth_movers.csv").write_text(
        "frame,timestamp,id,class,name\n0,0.0,3,person,person\n0,0.0,5,unknown,hook\n", encoding="utf-8")
    samples, names = read_samples(sequences, "val")
    assert names == ["person", "hook"]
    assert samples[0].classes.tolist() == [0, 1]
    assert samples[0].boxes.tolist() == [list(BOXES[0]), [0, 0, 20, 8]]
    assert read_samples(sequences, "train")[1] == names  # the same numbers in training


def test_a_network_numbers_the_classes_of_other_data(coco):
    samples, names = read_samples(coco, "train", ["hook", "dog", "person"])
    assert names == ["hook", "dog", "person"] and samples[0].classes.tolist() == [1, 2]
    with pytest.raises(SystemExit, match="has dog, but the network knows only person"):
        read_samples(coco, "train", ["person"])


def test_coco_is_read_with_classes_in_the_order_of_their_ids(coco):
    samples, names = read_samples(coco, "train")
    assert names == ["person", "dog"]
    assert samples[0].boxes.tolist() == [[10, 5, 30, 35], [0, 0, 80, 50]]
    assert samples[0].classes.tolist() == [1, 0] and samples[0].crowd.tolist() == [False, True]


def test_a_folder_without_data_is_an_error_with_a_fix(tmp_path):
    with pytest.raises(SystemExit, match="fix: stillmap simulate"):
        read_samples(tmp_path, "train")


def test_augmented_boxes_enclose_the_person(sequences):
    dataset = ImageDataset(read_samples(sequences, "train")[0], (96, 128), augment=True, cache=True)
    compared = 0
    for i in range(40):
        image, boxes, _ = dataset[i % 4]
        bright = image.min(2) > 140  # the person; the padding is 114 and is changed by at most 40 %
        for x0, y0, x1, y1 in boxes.round().astype(int):
            assert bright[y0 + 1:y1 - 1, x0 + 1:x1 - 1].mean() > 0.9 or image.max() < 200
            bright[max(y0 - 1, 0):y1 + 1, max(x0 - 1, 0):x1 + 1] = False
            compared += 1
    assert compared > 40


def test_map_of_true_and_of_shifted_boxes(sequences):
    samples, names = read_samples(sequences, "val")
    truth = evaluate.truth_of(samples, names)

    def results(shift):
        corners = [sample.boxes[0, :2] for sample in samples]
        return [{"image_id": i, "category_id": 0, "score": 0.9, "bbox": [x + shift, y, 40.0, 60.0]}
                for i, (x, y) in enumerate(corners)]

    assert evaluate.average_precision(truth, results(0))["map"] == pytest.approx(1)
    shifted = evaluate.average_precision(truth, results(8))  # IoU 32 / 48: five of ten thresholds
    assert shifted["map50"] == pytest.approx(1) and shifted["map"] == pytest.approx(0.4)
    assert evaluate.average_precision(truth, []) == {"map": 0, "map50": 0, "classes": {"person": 0}}
    assert evaluate.precision_and_recall(truth, results(0)[:2]) == {"precision": 1.0, "recall": 0.5}
    assert evaluate.precision_and_recall(truth, results(0) + results(60)) == {"precision": 0.5, "recall": 1.0}


def test_precision_of_each_class_that_the_truth_shows(sequences):
    samples, _ = read_samples(sequences, "val")
    for sample in samples[::2]:
        sample.classes[:] = 1
    truth = evaluate.truth_of(samples, ["person", "hook", "vehicle"])
    people = [{"image_id": i, "category_id": 0, "score": 0.9, "bbox": [*samples[i].boxes[0, :2].tolist(), 40.0, 60.0]}
              for i in (1, 3)]
    found = evaluate.average_precision(truth, people)
    assert found["classes"] == pytest.approx({"person": 1, "hook": 0}) and found["map"] == pytest.approx(0.5)


def test_training_evaluation_and_export_by_the_command_line(sequences, tmp_path, capsys):
    out = tmp_path / "out"
    train.main([str(sequences), "--improved", "--width", "0.125", "--size", "64", "96", "--epochs", "2", "--batch", "2",
                "--nominal-batch", "4", "--device", "cpu", "--out", str(out)])
    rows = [json.loads(line) for line in (out / "log.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [row["epoch"] for row in rows] == [1, 2] and all(0 <= row["map"] <= 1 for row in rows)
    evaluate.main([str(out / "last.pt"), str(sequences), "--size", "64", "96", "--device", "cpu"])
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["map"] == pytest.approx(rows[-1]["map"])
    export.main([str(out / "last.pt"), "--size", "64", "96", "--out", str(tmp_path / "a.onnx")])
    assert (tmp_path / "a.onnx").stat().st_size > 100_000


def test_the_moving_average_follows_the_weights():
    network = torch.nn.Linear(1, 1, bias=False)
    network.weight.data.fill_(0)
    average = train.MovingAverage(network)
    network.weight.data.fill_(1)
    average.update(network)
    decay = 0.9999 * (1 - np.exp(-1 / 2000))
    assert float(average.network.weight) == pytest.approx(1 - decay)


def test_the_schedule_warms_up_and_ends_at_a_tenth():
    optimizer = train.make_optimizer(torch.nn.Conv2d(1, 1, 1), 0.01)
    schedule = train.Schedule(optimizer, 0.01, epochs=10, steps_per_epoch=10, warmup_epochs=3)
    schedule.set(0)
    assert [group["lr"] for group in optimizer.param_groups] == [0.1, 0, 0]
    schedule.set(100)
    assert [group["lr"] for group in optimizer.param_groups] == pytest.approx([0.001] * 3)


@pytest.mark.parametrize("segments, expected", [(False, "1 0.250000 0.400000 0.250000 0.600000"),
                                                (True, "1 0.125000 0.100000 0.375000 0.100000 0.375000 0.700000")])
def test_labels_for_ultralytics(coco, tmp_path, segments, expected):
    samples, names = read_samples(coco, "train")
    description = fine_tune.write_dataset(samples * 10, names, tmp_path / "data", segments)
    labels = sorted((tmp_path / "data/labels/train").iterdir())
    assert len(labels) == 9 and len(list((tmp_path / "data/images/val").iterdir())) == 1
    assert labels[0].read_text(encoding="utf-8") == expected  # without the crowd
    assert "  1: dog" in description.read_text(encoding="utf-8")


def test_ultralytics_is_called_with_the_settings_of_the_paper(sequences, tmp_path, monkeypatch):
    calls = []

    class FakeYolo:
        def __init__(self, weights):
            calls.append(weights)

        def train(self, **settings):
            calls.append(settings)

    monkeypatch.setitem(sys.modules, "ultralytics", types.SimpleNamespace(YOLO=FakeYolo))
    train.main([str(sequences), "--architecture", "yolo11n", "--out", str(tmp_path / "out")])
    weights, settings = calls
    assert weights == "yolo11n.pt"
    assert {name: settings[name] for name in ("epochs", "patience", "batch", "lr0", "iou")} == {
        "epochs": 500, "patience": 50, "batch": 16, "lr0": 0.001, "iou": 0.5}


def test_without_ultralytics_the_error_says_how_to_install_it(sequences, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ultralytics", None)
    with pytest.raises(SystemExit, match="fix: pip install ultralytics"):
        train.main([str(sequences), "--architecture", "yolov8n-seg", "--out", str(tmp_path / "out")])
