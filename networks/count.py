# SPDX-License-Identifier: Apache-2.0
"""Parameters and GFLOPs of YOLOv7 and of the improved YOLOv7, and where they differ; or those of ONNX files.

  python -m networks.count
  python -m networks.count yolo11n.onnx yolov8n-seg.onnx
"""
import argparse
import math
from pathlib import Path

import onnx
import torch
from torch import nn

from networks.yolov7 import YOLOv7

VARIANTS = {"YOLOv7": {},
            "places, with GBS": {"ghost": True},
            "places, with GBS and Conv_SE": {"ghost": True, "attention": True},
            "modules, with GBS": {"ghost": True, "reading": "modules"},
            "modules, with GBS and Conv_SE": {"ghost": True, "attention": True, "reading": "modules"}}


def parameters(module):
    return sum(parameter.numel() for parameter in module.parameters())


@torch.no_grad()
def gflops(network, height=640, width=640):
    """Returns 10^9 floating-point operations of one image: two per multiplication of convolutions and linear layers."""
    operations = 0

    def count(layer, inputs, output):
        nonlocal operations
        if isinstance(layer, nn.Conv2d):
            products = layer.weight[0].numel() * output.numel() // len(output)
        else:
            products = layer.weight.numel()
        operations += 2 * products

    layers = [layer for layer in network.modules() if isinstance(layer, (nn.Conv2d, nn.Linear))]
    hooks = [layer.register_forward_hook(count) for layer in layers]
    network.eval()(torch.zeros(1, 3, height, width))
    for hook in hooks:
        hook.remove()
    return operations / 1e9


def shapes_of(graph):
    """Returns the shape of every tensor of an ONNX graph whose shapes were inferred."""
    shapes = {tensor.name: list(tensor.dims) for tensor in graph.initializer}
    for value in (*graph.input, *graph.value_info, *graph.output):
        shapes[value.name] = [dimension.dim_value for dimension in value.type.tensor_type.shape.dim]
    return shapes


def count_onnx(file, height=640, width=640):
    """Returns the parameters of an ONNX network, and its GFLOPs for one image of this size.

    As in gflops(), two operations per multiplication of convolutions and matrices. The file has a fixed size of its own;
    as the work of convolutions is proportional to the number of pixels, it is scaled. Parameters are the weights and
    biases of these layers.
    """
    graph = onnx.shape_inference.infer_shapes(onnx.load(file)).graph
    shapes, learned, products = shapes_of(graph), {}, 0
    weights = {tensor.name for tensor in graph.initializer}
    for node in graph.node:
        if node.op_type == "Conv":
            products += math.prod(shapes[node.output[0]]) * math.prod(shapes[node.input[1]][1:])
        elif node.op_type == "ConvTranspose":
            products += math.prod(shapes[node.input[0]]) * math.prod(shapes[node.input[1]][1:])
        elif node.op_type in ("MatMul", "Gemm"):
            products += math.prod(shapes[node.output[0]]) * shapes[node.input[0]][-1]
        else:
            continue
        learned |= {name: math.prod(shapes[name]) for name in node.input if name in weights}
    own_height, own_width = shapes[graph.input[0].name][2:]
    return sum(learned.values()), 2 * products / 1e9 * (height * width) / (own_height * own_width)


def differences(network, reference):
    """Returns (name, parameters, parameters of the reference) of the ELAN layers in which two networks differ."""
    rows = []
    for name, module in network.backbone.named_modules():
        parts = name.split(".")
        if not (parts[-1] in ("shortcut", "entry", "last") or parts[-2:-1] == ["chain"]):
            continue
        before, after = parameters(reference.backbone.get_submodule(name)), parameters(module)
        if before != after:
            rows.append((name, after, before))
    return rows


def print_files(files):
    print("| network | parameters | GFLOPs at 640x640 |\n|---|---|---|")
    for file in files:
        parameters_of_file, operations = count_onnx(file)
        print(f"| {file.name} | {parameters_of_file:,} | {operations:.1f} |")


def print_variants():
    print("| network | parameters | for inference | GFLOPs at 640x640 |\n|---|---|---|---|")
    networks = {name: YOLOv7(80, **settings) for name, settings in VARIANTS.items()}
    for name, network in networks.items():
        deployed = network.deployed()
        print(f"| {name} | {parameters(network):,} | {parameters(deployed):,} | {gflops(deployed):.1f} |")
    print("\n| layer of the backbone | YOLOv7 | improved | difference |\n|---|---|---|---|")
    for name, after, before in differences(networks["places, with GBS and Conv_SE"], networks["YOLOv7"]):
        print(f"| {name} | {before:,} | {after:,} | {after - before:+,} |")


def main(words=None):
    parser = argparse.ArgumentParser(prog="python -m networks.count", description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="*", help="ONNX files; without any, YOLOv7 and its variants")
    settings = parser.parse_args(words)
    if settings.files:
        print_files(settings.files)
    else:
        print_variants()


if __name__ == "__main__":
    main()
