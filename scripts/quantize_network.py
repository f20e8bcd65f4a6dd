#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Converts a YOLO network (.onnx) from 32-bit floats to 8-bit integers or 16-bit floats, for `stillmap run --model`.

  scripts/quantize_network.py MODEL.onnx PICTURES_DIR...           # 8-bit integers, for CPUs: MODEL_int8.onnx
  scripts/quantize_network.py MODEL.onnx PICTURES_DIR... --half    # 16-bit floats, for CUDA: MODEL_fp16.onnx

Needs the Python packages numpy, onnx, onnxruntime and pillow. PICTURES_DIR contains typical images of the camera
(the rgb folder of a recording): --pictures of them (64), evenly distributed, calibrate the value ranges; on half as many
others the detections of both networks are compared: use the result only if they agree.

Only convolutions followed by an activation (SiLU) are quantized. The layers after the last of them contain boxes in
pixels together with scores below one, which need more than eight bits. Weights have a scale per channel, which needs ONNX operators 13
(older networks are converted), and seven bits: processors without VNNI add products of eight in 16 bits, which
overflow.

With --half all layers are converted; input and outputs stay 32-bit floats. (TensorRT uses 16-bit floats by itself.)
"""
import argparse
import sys
import tempfile
from pathlib import Path

PACKAGES = ["numpy", "onnx", "onnxruntime", "pillow"]

try:
    import numpy as np
    import onnx
    import onnxruntime
    from onnx import version_converter
    from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static
    from onnxruntime.transformers.float16 import convert_float_to_float16
    from PIL import Image
except ImportError as missing:
    sys.exit(f"quantize_network: {missing}; fix: pip install {' '.join(PACKAGES)}")

OPERATORS = 13  # the first with scales per channel
GRAY = 114  # padding value that networks are trained with
SURE, SAME = 0.5, 0.7  # a score, and an overlap of boxes


def input_of(model):
    value = model.graph.input[0]
    height, width = (d.dim_value for d in value.type.tensor_type.shape.dim[2:4])
    if not height or not width:
        sys.exit("quantize_network: the network leaves its input's size open; fix: export it with imgsz=256,320")
    return value.name, height, width


def letterboxed(file, height, width):
    """Returns the image scaled to fit, with gray padding: 1 x 3 x height x width, RGB, 0 to 1."""
    image = Image.open(file).convert("RGB")
    scale = min(width / image.width, height / image.height)
    size = round(image.width * scale), round(image.height * scale)
    canvas = Image.new("RGB", (width, height), (GRAY, GRAY, GRAY))
    canvas.paste(image.resize(size, Image.BILINEAR), ((width - size[0]) // 2, (height - size[1]) // 2))
    return (np.asarray(canvas, np.float32) / 255).transpose(2, 0, 1)[None]


def images_in(folders, count):
    """Returns `count` image files, evenly distributed, and half as many others in between."""
    files = [f for d in folders for f in sorted(Path(d).iterdir()) if f.suffix.lower() in (".png", ".jpg", ".jpeg")]
    if len(files) < 16:
        named = ", ".join(map(str, folders))
        sys.exit(f"quantize_network: {len(files)} images in {named}; fix: give folders with 16 or more")
    spread = [files[i] for i in np.linspace(0, len(files) - 1, min(3 * count // 2, len(files))).astype(int)]
    return [f for n, f in enumerate(spread) if n % 3 != 1], spread[1::3]


def convolutions_to_leave(model):
    """Names of those that no activation follows: of the head, and within attention."""
    activated = {name for node in model.graph.node if node.op_type == "Sigmoid" for name in node.input}
    return [n.name for n in model.graph.node if n.op_type == "Conv" and n.output[0] not in activated]


class CalibrationImages(CalibrationDataReader):
    def __init__(self, name, inputs):
        self.inputs = ({name: x} for x in inputs)

    def get_next(self):
        return next(self.inputs, None)


def quantized(source, inputs, out):
    model = onnx.load(source)
    converted = model
    if model.opset_import[0].version < OPERATORS:
        converted = version_converter.convert_version(model, OPERATORS)
    name, _, _ = input_of(converted)
    with tempfile.TemporaryDirectory() as folder:
        onnx.save(converted, f"{folder}/float.onnx")
        quantize_static(f"{folder}/float.onnx", f"{folder}/int8.onnx", CalibrationImages(name, inputs),
                        quant_format=QuantFormat.QDQ, op_types_to_quantize=["Conv"], per_channel=True,
                        reduce_range=True, activation_type=QuantType.QUInt8, weight_type=QuantType.QInt8,
                        nodes_to_exclude=convolutions_to_leave(converted))
        result = onnx.load(f"{folder}/int8.onnx")
    del result.metadata_props[:]
    result.metadata_props.extend(model.metadata_props)  # the names of the classes
    onnx.save(result, out)


def halved(source, out):
    """Writes the network with 16-bit floats inside and 32-bit floats as input and outputs."""
    onnx.save(convert_float_to_float16(onnx.load(source), keep_io_types=True), out)


def sure_boxes(output):
    """[4 + classes + ..., boxes], the largest score of 80 classes: boxes as x0, y0, x1, y1."""
    scores = output[4:84].max(axis=0)
    x, y, w, h = output[:4, scores > SURE]
    return np.stack([x - w / 2, y - h / 2, x + w / 2, y + h / 2], axis=1)


def overlaps(box, boxes):
    if len(boxes) == 0:
        return np.zeros(1)
    low, high = np.maximum(box[:2], boxes[:, :2]), np.minimum(box[2:], boxes[:, 2:])
    common = np.prod(np.clip(high - low, 0, None), axis=1)
    return common / (np.prod(box[2:] - box[:2]) + np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) - common)


def found_again(before, after):
    """Returns the number of boxes of one network that the other one finds too, and the number of all its boxes."""
    best = [overlaps(box, after).max() for box in before]
    return sum(o > SAME for o in best), len(best)


def compare(source, out, inputs):
    networks = [onnxruntime.InferenceSession(str(f), providers=["CPUExecutionProvider"]) for f in (source, out)]
    name = networks[0].get_inputs()[0].name
    kept, boxes, true, found = 0, 0, 0, 0
    for x in inputs:
        before, after = (sure_boxes(network.run(None, {name: x})[0][0]) for network in networks)
        kept, boxes = map(sum, zip((kept, boxes), found_again(before, after)))
        true, found = map(sum, zip((true, found), found_again(after, before)))
    print(f"{len(inputs)} other images: {kept} of {boxes} confident boxes are still detected, "
          f"{found - true} of {found} are new (overlap {SAME})")
    return boxes == 0 or kept >= 0.9 * boxes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path)
    parser.add_argument("folders", type=Path, nargs="+", metavar="PICTURES_DIR")
    parser.add_argument("--half", action="store_true", help="16-bit floats instead of 8-bit integers")
    parser.add_argument("--out", type=Path, help="default: MODEL_int8.onnx or MODEL_fp16.onnx beside the model")
    parser.add_argument("--pictures", type=int, default=64)
    arguments = parser.parse_args()
    ending = "_fp16.onnx" if arguments.half else "_int8.onnx"
    out = arguments.out or arguments.model.with_name(arguments.model.stem + ending)
    for path in [arguments.model, *arguments.folders]:
        if not path.exists():
            sys.exit(f"quantize_network: {path} is missing")
    _, height, width = input_of(onnx.load(arguments.model))
    to_learn, to_compare = images_in(arguments.folders, arguments.pictures)
    if arguments.half:
        halved(arguments.model, out)
    else:
        quantized(arguments.model, [letterboxed(f, height, width) for f in to_learn], out)
    print(f"written: {out} ({out.stat().st_size / 1e6:.1f} MB; {arguments.model.stat().st_size / 1e6:.1f} MB before)")
    if not compare(arguments.model, out, [letterboxed(f, height, width) for f in to_compare]):
        sys.exit("quantize_network: more than a tenth is no longer found: do not use it; fix: more and different images")


if __name__ == "__main__":
    main()
