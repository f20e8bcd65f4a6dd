# SPDX-License-Identifier: Apache-2.0
"""YOLOv7 (Wang, Bochkovskiy, Liao, CVPR 2023) and the improved YOLOv7 of the paper (see blocks.py).

    network = YOLOv7(classes=80)                                  # 37.62 M parameters in training
    network = YOLOv7(classes=80, ghost=True, attention=True)      # the improved network
    heads = network(images)                                       # three heads of raw outputs

`images` are [batch, 3, height, width], RGB, 0 to 1, with height and width divisible by 32. The heads are
[batch, 3, height / stride, width / stride, 5 + classes], logits; boxes.py decodes them.
"""
import copy
import math

import torch
from torch import nn
from torch.nn import functional as F

from networks.blocks import CBS, ELAN, ELANH, GBS, MP, SPPCSPC, ConvSE, ImplicitConv, RepConv, fuse

STRIDES = (8, 16, 32)
ANCHORS = (((12, 16), (19, 36), (40, 28)),  # width and height of the anchor boxes per stride [pixels]
           ((36, 75), (76, 55), (72, 146)),
           ((142, 110), (192, 243), (459, 401)))
# Two interpretations of ELAN-1 and ELAN-2 in the paper's figure 1: (stages with GBS, stages with Conv_SE). As places they
# are the ELANs of strides 8 and 16, both with both changes; as modules they are two types, ELAN-1 with GBS and ELAN-2 with
# Conv_SE.
READINGS = {"places": ((2, 3), (2, 3)), "modules": ((2, 4), (3,))}


class Backbone(nn.Module):
    """Stem and four ELAN stages; returns the maps of strides 8, 16 and 32.

    @param c          maps a published channel number to that of this width
    @param ghost      GBS in place of CBS before the last layer of the ELANs that the reading names
    @param attention  Conv_SE as the last layer of the ELANs that the reading names
    @param reading    key of READINGS
    """

    def __init__(self, c, ghost, attention, reading):
        super().__init__()
        with_ghosts, with_attention = READINGS[reading]

        def elan(stage, before, hidden, after):
            return ELAN(c(before), c(hidden), c(after), GBS if ghost and stage in with_ghosts else CBS,
                        ConvSE if attention and stage in with_attention else CBS)

        self.stem = nn.Sequential(CBS(3, c(32), 3), CBS(c(32), c(64), 3, 2), CBS(c(64), c(64), 3),
                                  CBS(c(64), c(128), 3, 2))
        self.stage1 = elan(1, 128, 64, 256)
        self.stage2 = nn.Sequential(MP(c(256), c(128)), elan(2, 256, 128, 512))
        self.stage3 = nn.Sequential(MP(c(512), c(256)), elan(3, 512, 256, 1024))
        self.stage4 = nn.Sequential(MP(c(1024), c(512)), elan(4, 1024, 256, 1024))

    def forward(self, x):
        p3 = self.stage2(self.stage1(self.stem(x)))
        p4 = self.stage3(p3)
        return p3, p4, self.stage4(p4)


class Neck(nn.Module):
    """Path aggregation network (PANet): top-down by upsampling, then bottom-up by MP blocks."""

    def __init__(self, c):
        super().__init__()
        self.spp = SPPCSPC(c(1024), c(512))
        self.reduce5, self.lateral4 = CBS(c(512), c(256)), CBS(c(1024), c(256))
        self.down4 = ELANH(c(512), c(256), c(256))
        self.reduce4, self.lateral3 = CBS(c(256), c(128)), CBS(c(512), c(128))
        self.down3 = ELANH(c(256), c(128), c(128))
        self.half3 = MP(c(128), c(128))
        self.up4 = ELANH(c(512), c(256), c(256))
        self.half4 = MP(c(256), c(256))
        self.up5 = ELANH(c(1024), c(512), c(512))

    def forward(self, p3, p4, p5):
        p5 = self.spp(p5)
        p4 = self.down4(torch.cat([self.lateral4(p4), F.interpolate(self.reduce5(p5), scale_factor=2.0)], 1))
        p3 = self.down3(torch.cat([self.lateral3(p3), F.interpolate(self.reduce4(p4), scale_factor=2.0)], 1))
        n4 = self.up4(torch.cat([self.half3(p3), p4], 1))
        return p3, n4, self.up5(torch.cat([self.half4(n4), p5], 1))


class YOLOv7(nn.Module):
    """The network. `width` scales all channel numbers (1 is the published network); `reading` is a key of READINGS."""

    def __init__(self, classes, ghost=False, attention=False, width=1.0, reading="places"):
        super().__init__()
        self.classes = classes
        self.settings = {"classes": classes, "ghost": ghost, "attention": attention, "width": width, "reading": reading}

        def c(channels):
            return max(8, round(channels * width / 8) * 8)

        self.backbone = Backbone(c, ghost, attention, reading)
        self.neck = Neck(c)
        self.rep = nn.ModuleList([RepConv(c(n), c(2 * n)) for n in (128, 256, 512)])
        self.out = nn.ModuleList([ImplicitConv(c(n), 3 * (5 + classes)) for n in (256, 512, 1024)])
        self.initialize_biases()

    def initialize_biases(self):
        """Sets the output biases so that training starts with few false detections: 8 objects per 640x640 image."""
        for head, stride in zip(self.out, STRIDES):
            bias = head.conv.bias.data.view(3, -1)
            bias[:, 4] = math.log(8 / (640 / stride) ** 2)
            bias[:, 5:] = math.log(0.6 / (self.classes - 0.99))

    def forward(self, images):
        maps = self.neck(*self.backbone(images))
        return [as_anchors(out(rep(x)), self.classes) for out, rep, x in zip(self.out, self.rep, maps)]

    def deployed(self):
        """Returns a copy for inference: RepConv as one convolution, no implicit vectors, no batch normalization."""
        network = copy.deepcopy(self).eval()
        network.rep = nn.ModuleList([block.fused() for block in network.rep])
        network.out = nn.ModuleList([head.fused() for head in network.out])
        for module in list(network.modules()):
            if isinstance(module, CBS):
                module.conv, module.bn = fuse(module.conv, module.bn), nn.Identity()
        return network.requires_grad_(False)


def as_anchors(x, classes):
    """[batch, 3 (5 + classes), height, width] -> [batch, 3, height, width, 5 + classes]"""
    batch, _, height, width = x.shape
    return x.view(batch, 3, 5 + classes, height, width).permute(0, 1, 3, 4, 2)


def save(network, names, file):
    """Writes the weights, the settings of the network and the class names."""
    torch.save({"settings": network.settings, "names": list(names), "weights": network.state_dict()}, file)


def load(file):
    """Returns the network and its class names."""
    stored = torch.load(file, map_location="cpu", weights_only=True)
    network = YOLOv7(**stored["settings"])
    network.load_state_dict(stored["weights"])
    return network.eval(), stored["names"]
