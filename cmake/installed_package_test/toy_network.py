# SPDX-License-Identifier: Apache-2.0
"""Writes a tiny ONNX network with the input and output shapes of a YOLOv8 detector, which detects nothing.

GlobalAveragePool, a 1x1 convolution with zero weights, and Reshape: 1 x 3 x 96 x 96 -> 1 x 84 x 189.
"""

SIDE = 96  # [pixels]
CLASSES, ANCHORS = 80, 189  # (96 / 8)^2 + (96 / 16)^2 + (96 / 32)^2
ROWS = 4 + CLASSES
FLOAT, INT64 = 1, 7  # of TensorProto.DataType
INTS = 7  # of AttributeProto.AttributeType


def varint(value):
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out) + bytes([value])


def number(field, value):
    return varint(field << 3) + varint(value)


def message(field, content):
    content = content.encode() if isinstance(content, str) else content
    return varint(field << 3 | 2) + varint(len(content)) + content


def value_info(name, shape):
    dimensions = b"".join(message(1, number(1, n)) for n in shape)
    return message(1, name) + message(2, message(1, number(1, FLOAT) + message(2, dimensions)))


def initializer(name, kind, shape, raw):
    return b"".join(number(1, n) for n in shape) + number(2, kind) + message(8, name) + message(9, raw)


def node(operation, inputs, output, attributes=b""):
    return (b"".join(message(1, name) for name in inputs) + message(2, output) + message(3, operation) +
            message(4, operation) + attributes)


def write(path):
    channels = ROWS * ANCHORS
    shape = b"".join(n.to_bytes(8, "little") for n in (1, ROWS, ANCHORS))
    kernel = message(5, message(1, "kernel_shape") + number(8, 1) + number(8, 1) + number(20, INTS))
    graph = b"".join([
        message(1, node("GlobalAveragePool", ["image"], "mean")),
        message(1, node("Conv", ["mean", "weights"], "flat", kernel)),
        message(1, node("Reshape", ["flat", "shape"], "boxes")),
        message(2, "toy"),
        message(5, initializer("weights", FLOAT, (channels, 3, 1, 1), bytes(4 * channels * 3))),
        message(5, initializer("shape", INT64, (3,), shape)),
        message(11, value_info("image", (1, 3, SIDE, SIDE))),
        message(12, value_info("boxes", (1, ROWS, ANCHORS))),
    ])
    path.write_bytes(number(1, 7) + message(2, "stillmap") + message(7, graph) +
                     message(8, message(1, "") + number(2, 12)))
