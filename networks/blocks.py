# SPDX-License-Identifier: Apache-2.0
"""The blocks of YOLOv7 and of the improved YOLOv7.

Sources: YOLOv7 (Wang, Bochkovskiy, Liao, CVPR 2023), RepVGG (Ding et al., CVPR 2021), GhostNet (Han et al., CVPR 2020),
SE (Hu, Shen, Sun, CVPR 2018), YOLOR's implicit knowledge (Wang, Yeh, Liao, 2021), and "Visual SLAM algorithm for fusing
improved YOLOv7 in dynamic scenes" (Shi et al., 2024), called "the paper" below. All tensors are
[batch, channels, height, width].
"""
import torch
from torch import nn
from torch.nn import functional as F

BN_EPSILON, BN_MOMENTUM = 1e-3, 0.03  # of YOLOv7


def batch_norm(channels):
    return nn.BatchNorm2d(channels, eps=BN_EPSILON, momentum=BN_MOMENTUM)


class CBS(nn.Module):
    """Convolution, batch normalization, SiLU."""

    def __init__(self, before, after, kernel=1, stride=1, groups=1):
        super().__init__()
        self.conv = nn.Conv2d(before, after, kernel, stride, kernel // 2, groups=groups, bias=False)
        self.bn = batch_norm(after)

    def forward(self, x):
        return F.silu(self.bn(self.conv(x)))


class GBS(nn.Module):
    """GhostConv, batch normalization, SiLU: the lightweight replacement of CBS.

    Half of the channels come from a convolution, the other half ("ghosts") from a 5x5 depthwise convolution of those.
    GhostNet's cheap operation is 3x3; 5x5 is the kernel of the GhostConv used in the YOLO family.
    """

    def __init__(self, before, after, kernel=1, stride=1, cheap_kernel=5):
        super().__init__()
        self.primary = CBS(before, after // 2, kernel, stride)
        self.cheap = CBS(after // 2, after // 2, cheap_kernel, groups=after // 2)

    def forward(self, x):
        intrinsic = self.primary(x)
        return torch.cat([intrinsic, self.cheap(intrinsic)], 1)


class SE(nn.Module):
    """Squeeze-and-excitation: weights each channel by a function of all channel means."""

    def __init__(self, channels, reduction=16):
        super().__init__()
        self.squeeze = nn.Linear(channels, channels // reduction, bias=False)
        self.excite = nn.Linear(channels // reduction, channels, bias=False)

    def forward(self, x):
        means = x.mean((2, 3))
        weights = torch.sigmoid(self.excite(F.relu(self.squeeze(means))))
        return x * weights[:, :, None, None]


class ConvSE(nn.Module):
    """Conv_SE of the paper: CBS followed by channel attention, the last layer of ELAN-1 and ELAN-2."""

    def __init__(self, before, after):
        super().__init__()
        self.cbs = CBS(before, after)
        self.se = SE(after)

    def forward(self, x):
        return self.se(self.cbs(x))


class ELAN(nn.Module):
    """Efficient layer aggregation network of the backbone: two 1x1 branches and a chain of four 3x3 convolutions, of
    which the second and the fourth are concatenated with both branches and fused by a 1x1 layer.

    @param conv  the six layers before the last one: CBS or GBS
    @param last  fusing layer: CBS or ConvSE
    """

    def __init__(self, before, hidden, after, conv=CBS, last=CBS):
        super().__init__()
        self.shortcut = conv(before, hidden)
        self.entry = conv(before, hidden)
        self.chain = nn.ModuleList([conv(hidden, hidden, 3) for _ in range(4)])
        self.last = last(4 * hidden, after)

    def forward(self, x):
        kept = [self.shortcut(x), self.entry(x)]
        y = kept[-1]
        for i, layer in enumerate(self.chain):
            y = layer(y)
            if i % 2 == 1:
                kept.append(y)
        return self.last(torch.cat(kept, 1))


class ELANH(nn.Module):
    """ELAN-H of the head: a chain at half the width, all of whose four layers are concatenated."""

    def __init__(self, before, hidden, after):
        super().__init__()
        self.shortcut = CBS(before, hidden)
        self.entry = CBS(before, hidden)
        widths = [hidden, *[hidden // 2] * 4]
        self.chain = nn.ModuleList([CBS(a, b, 3) for a, b in zip(widths, widths[1:])])
        self.last = CBS(2 * hidden + 4 * (hidden // 2), after)

    def forward(self, x):
        kept = [self.shortcut(x), self.entry(x)]
        for layer in self.chain:
            kept.append(layer(kept[-1]))
        return self.last(torch.cat(kept, 1))


class MP(nn.Module):
    """Halves the resolution in two branches: max pooling with 1x1, and 1x1 with a 3x3 convolution of stride 2.
    The output has twice `branch` channels."""

    def __init__(self, before, branch):
        super().__init__()
        self.after_pool = CBS(before, branch)
        self.before_stride = CBS(before, branch)
        self.strided = CBS(branch, branch, 3, 2)

    def forward(self, x):
        return torch.cat([self.strided(self.before_stride(x)), self.after_pool(F.max_pool2d(x, 2))], 1)


class SPPCSPC(nn.Module):
    """Spatial pyramid pooling (max over 5x5, 9x9 and 13x13) in a cross-stage partial block."""

    def __init__(self, before, after):
        super().__init__()
        self.entry = nn.Sequential(CBS(before, after), CBS(after, after, 3), CBS(after, after))
        self.pooled = nn.Sequential(CBS(4 * after, after), CBS(after, after, 3))
        self.shortcut = CBS(before, after)
        self.last = CBS(2 * after, after)

    def forward(self, x):
        y = self.entry(x)
        pools = [F.max_pool2d(y, k, 1, k // 2) for k in (5, 9, 13)]
        return self.last(torch.cat([self.pooled(torch.cat([y, *pools], 1)), self.shortcut(x)], 1))


def fuse(convolution, bn):
    """Returns the convolution with bias that equals a convolution without bias and its batch normalization."""
    scale = bn.weight / torch.sqrt(bn.running_var + bn.eps)
    fused = nn.Conv2d(convolution.in_channels, convolution.out_channels, convolution.kernel_size, convolution.stride,
                      convolution.padding, groups=convolution.groups)
    fused.weight.data = convolution.weight * scale[:, None, None, None]
    fused.bias.data = bn.bias - bn.running_mean * scale
    return fused.requires_grad_(False)


class RepConv(nn.Module):
    """RepConvN of YOLOv7, re-parameterized RepVGG without the identity branch: a 3x3 and a 1x1 convolution with their
    batch normalizations, added. fused() returns the single 3x3 convolution that equals both."""

    def __init__(self, before, after):
        super().__init__()
        self.conv3, self.bn3 = nn.Conv2d(before, after, 3, 1, 1, bias=False), batch_norm(after)
        self.conv1, self.bn1 = nn.Conv2d(before, after, 1, bias=False), batch_norm(after)

    def forward(self, x):
        return F.silu(self.bn3(self.conv3(x)) + self.bn1(self.conv1(x)))

    def fused(self):
        conv3, conv1 = fuse(self.conv3, self.bn3), fuse(self.conv1, self.bn1)
        conv3.weight.data += F.pad(conv1.weight, [1, 1, 1, 1])
        conv3.bias.data += conv1.bias
        return nn.Sequential(conv3, nn.SiLU())


class ImplicitConv(nn.Module):
    """The output layer of a head, a 1x1 convolution between two vectors of implicit knowledge (YOLOR): one is added to
    its input, the other multiplies its output. fused() returns the convolution that contains them."""

    def __init__(self, before, after):
        super().__init__()
        self.added = nn.Parameter(0.02 * torch.randn(before))
        self.conv = nn.Conv2d(before, after, 1)
        self.factor = nn.Parameter(1 + 0.02 * torch.randn(after))

    def forward(self, x):
        return self.factor[:, None, None] * self.conv(x + self.added[:, None, None])

    def fused(self):
        fused = nn.Conv2d(self.conv.in_channels, self.conv.out_channels, 1)
        weight = self.conv.weight.data
        fused.weight.data = weight * self.factor.data[:, None, None, None]
        fused.bias.data = (self.conv.bias.data + weight[:, :, 0, 0] @ self.added.data) * self.factor.data
        return fused.requires_grad_(False)
