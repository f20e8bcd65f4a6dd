# SPDX-License-Identifier: Apache-2.0
"""Exports a trained network to ONNX for `stillmap run --model`.

  python -m networks.export best.pt --size 256 320 --out yolov7.onnx           # [1, anchors, 5 + classes], decoded
  python -m networks.export best.pt --size 256 320 --raw --out yolov7.onnx     # three heads [1, 3, h, w, 5 + classes]

Both are layouts of YOLOv7's own export, with and without its grid. The class names are stored as metadata.
"""
import argparse
from pathlib import Path

import onnx
import torch

from networks import yolov7
from networks.boxes import Decoded

OPERATORS = 12  # read by OpenVINO, ONNX Runtime and OpenCV 4.6


def export(network, names, size, file, raw=False):
    """Writes the network, prepared for inference, with a fixed input of `size` (height, width)."""
    deployed = network.deployed()
    model = deployed if raw else Decoded(deployed, *size)
    outputs = ["head8", "head16", "head32"] if raw else ["output"]
    torch.onnx.export(model.eval(), torch.zeros(1, 3, *size), str(file), input_names=["images"], output_names=outputs,
                      opset_version=OPERATORS, dynamo=False)
    written = onnx.load(file)
    onnx.helper.set_model_props(written, {"names": str(dict(enumerate(names))), "task": "detect"})
    onnx.checker.check_model(written)
    onnx.save(written, file)


def main(words=None):
    parser = argparse.ArgumentParser(prog="python -m networks.export", description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path)
    parser.add_argument("--size", type=int, nargs=2, default=[480, 640], metavar=("HEIGHT", "WIDTH"))
    parser.add_argument("--raw", action="store_true", help="three heads of logits instead of decoded boxes")
    parser.add_argument("--out", type=Path, required=True)
    settings = parser.parse_args(words)
    if any(n % 32 for n in settings.size):
        parser.error("--size must be divisible by 32")
    export(*yolov7.load(settings.weights), settings.size, settings.out, settings.raw)
    print(f"written: {settings.out}")


if __name__ == "__main__":
    main()
