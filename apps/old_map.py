# SPDX-License-Identifier: Apache-2.0
"""Writes a map file as version 0.1.0 did (docs/map_file.md, layout 3), byte by byte: two keyframes that are 0.1 m apart
and see one landmark. No part of the program is used, so it reads what earlier ones wrote as long as the tests pass."""
import struct
import zlib

LAYOUT = 3
PROGRAM = "stillmap 0.1.0"
LANDMARK = (0.1, 0.2, 2.0)  # position in the world [m]


def text(content):
    return struct.pack("<I", len(content)) + content.encode()


def column(form, *values):
    """The first bytes of all values, then all second bytes, and so on."""
    size = struct.calcsize("<" + form)
    packed = b"".join(struct.pack("<" + form, value) for value in values)
    return b"".join(packed[i::size] for i in range(size))


def pose(x):
    return struct.pack("<7d", 0, 0, 0, 1, x, 0, 0)


def camera():
    return (text("old camera") + struct.pack("<2i4d", 320, 240, 280, 280, 160, 120) + struct.pack("<5d", *[0] * 5) +
            struct.pack("<3d", 5000, 30, 0.075) + text("kinect_v1") + struct.pack("<id", 8, 1.2))


def keyframe(number):
    u, v = 160 + 280 * (LANDMARK[0] - 0.1 * number) / LANDMARK[2], 120 + 280 * LANDMARK[1] / LANDMARK[2]
    features = b"".join(column("f", value) for value in (u, v, 0.5, 30, LANDMARK[2]))
    return (struct.pack("<3I", 3 * number, 0, 0) + bytes([number == 0]) + struct.pack("<Qd", 10 * number, number / 3) +
            pose(0.1 * number) + struct.pack("<I", 1) + features + bytes([0]) + bytes(range(32)) + column("f", 0.9))


def landmarks():
    direction = [value / sum(p * p for p in LANDMARK) ** 0.5 for value in LANDMARK]
    columns = column("I", 2)
    for position, mean in zip(LANDMARK, direction):
        columns += column("d", position) + column("d", mean)
    columns += column("f", 1.0) + column("f", 4.0) + column("I", 0) + column("I", 9) + column("I", 7) + column("f", 2.0)
    return struct.pack("<I", 1) + columns + bytes(range(32)) + column("I", 0, 1) + column("I", 0, 0)


def compressed(content):
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(content) + packer.flush()


def old_map():
    contents = {"CAMR": camera(), "KEYF": struct.pack("<I", 2) + keyframe(0) + keyframe(1), "LAND": landmarks(),
                "INFO": text(PROGRAM), "DENS": struct.pack("<I", 0)}
    packed = {name: compressed(content) for name, content in contents.items()}
    size = 28 + 24 * len(packed) + sum(map(len, packed.values()))
    header = b"STILLMAP" + struct.pack("<2IQ", LAYOUT, len(packed), size)
    for name, content in packed.items():
        header += name.encode() + struct.pack("<IQQ", zlib.crc32(content), len(content), len(contents[name]))
    return header + struct.pack("<I", zlib.crc32(header)) + b"".join(packed.values())
