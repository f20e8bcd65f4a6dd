# SPDX-License-Identifier: Apache-2.0
"""Images in serialized form: their pixels are not copied, which costs as much as tracking's other work in Python."""
import struct
from types import SimpleNamespace

from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Image

LITTLE_ENDIAN = b"\x00\x01"  # plain CDR, the form of ROS 2 (OMG DDSI-RTPS 10.2)
HEADER = 4  # bytes before the message, from whose end on numbers are aligned


class Reader:
    def __init__(self, data):
        self.data, self.at = memoryview(data), HEADER

    def integer(self, kind="I"):
        """Returns an integer of four bytes."""
        begin = self.at + -self.at % 4
        self.at = begin + 4
        return struct.unpack_from("<" + kind, self.data, begin)[0]

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def bytes(self):
        size = self.integer()
        self.at += size
        return self.data[self.at - size:self.at]

    def text(self):
        return bytes(self.bytes()[:-1]).decode()


def image_of(data):
    """Returns the fields of a serialized sensor_msgs/Image, whose data is a view of it."""
    if bytes(data[:2]) != LITTLE_ENDIAN:
        return deserialize_message(bytes(data), Image)
    read = Reader(data)
    stamp = SimpleNamespace(sec=read.integer("i"), nanosec=read.integer())
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp, frame_id=read.text()), height=read.integer(),
                           width=read.integer(), encoding=read.text(), is_bigendian=read.byte(), step=read.integer(),
                           data=read.bytes())
