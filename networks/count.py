# SPDX-License-Identifier: Apache-2.0
"""Parameters and GFLOPs of YOLOv7 and of the improved YOLOv7, and where they differ.

  python -m networks.count
"""
import torch
from torch import nn

from networks.yolov7 import YOLOv7

VARIANTS = {"YOLOv7": {}, "with GBS": {"ghost": True}, "with GBS and Conv_SE": {"ghost": True, "attention": True}}


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


def main():
    print("| network | parameters | for inference | GFLOPs at 640x640 |\n|---|---|---|---|")
    networks = {name: YOLOv7(80, **settings) for name, settings in VARIANTS.items()}
    for name, network in networks.items():
        deployed = network.deployed()
        print(f"| {name} | {parameters(network):,} | {parameters(deployed):,} | {gflops(deployed):.1f} |")
    print("\n| layer of the backbone | YOLOv7 | improved | difference |\n|---|---|---|---|")
    *_, improved = networks.values()
    for name, after, before in differences(improved, networks["YOLOv7"]):
        print(f"| {name} | {before:,} | {after:,} | {after - before:+,} |")


if __name__ == "__main__":
    main()
