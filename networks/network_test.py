# SPDX-License-Identifier: Apache-2.0
"""Parameters, operations and layers of the networks."""
import pytest
import torch
from torch import nn

from networks import blocks, count
from networks.yolov7 import READINGS, YOLOv7, load, save


def with_random_statistics(network, seed=2):
    """Gives every batch normalization other statistics than the initial ones, as training would."""
    generator = torch.Generator().manual_seed(seed)
    for module in network.modules():
        if isinstance(module, nn.BatchNorm2d):
            for values, low, high in ((module.weight.data, 0.5, 1.5), (module.bias.data, -0.5, 0.5),
                                      (module.running_mean, -0.2, 0.2), (module.running_var, 0.5, 1.5)):
                values.uniform_(low, high, generator=generator)
    return network.eval()


@pytest.fixture(scope="module")
def networks():
    return {name: YOLOv7(80, **settings) for name, settings in count.VARIANTS.items()}


def test_yolov7_has_the_published_number_of_parameters(networks):
    network = networks["YOLOv7"]
    assert count.parameters(network) == 37_622_682  # "37.62 M" in the paper
    assert count.parameters(network.deployed()) == 36_905_341  # "36.9 M" in Table 1 of YOLOv7


def test_elans_read_as_places_give_the_number_of_the_paper_without_attention(networks):
    assert count.parameters(networks["places, with GBS"]) == 36_013_082  # "36.01 M" in the paper
    assert count.parameters(networks["places, with GBS and Conv_SE"]) == 36_176_922


def test_elans_read_as_modules_give_the_number_of_the_paper_with_attention(networks):
    assert count.parameters(networks["modules, with GBS"]) == 35_882_010
    assert count.parameters(networks["modules, with GBS and Conv_SE"]) == 36_013_082


@pytest.mark.parametrize("name, stages", [("places, with GBS", {"stage2", "stage3"}),
                                          ("places, with GBS and Conv_SE", {"stage2", "stage3"}),
                                          ("modules, with GBS", {"stage2", "stage4"}),
                                          ("modules, with GBS and Conv_SE", {"stage2", "stage3", "stage4"})])
def test_all_differences_are_in_the_elans_of_the_reading(networks, name, stages):
    rows = count.differences(networks[name], networks["YOLOv7"])
    total = count.parameters(networks[name]) - count.parameters(networks["YOLOv7"])
    assert sum(after - before for _, after, before in rows) == total
    assert {row[0].split(".")[0] for row in rows} == stages


def test_the_readings_have_other_operations(networks):
    assert count.gflops(networks["places, with GBS"].deployed()) == pytest.approx(96.3, abs=0.05)
    assert count.gflops(networks["modules, with GBS and Conv_SE"].deployed()) == pytest.approx(99.3, abs=0.05)


def test_attention_costs_two_matrices_per_elan(networks):
    added = count.parameters(networks["places, with GBS and Conv_SE"]) - count.parameters(networks["places, with GBS"])
    assert added == 2 * 512 * 32 + 2 * 1024 * 64


def test_operations_are_those_published(networks):
    assert count.gflops(networks["YOLOv7"].deployed()) == pytest.approx(104.7, rel=0.005)


def test_operations_of_one_convolution():
    assert count.gflops(nn.Conv2d(3, 8, 3, padding=1), 10, 20) == pytest.approx(2 * 27 * 8 * 200 / 1e9)


@pytest.mark.parametrize("improved", [False, True])
def test_heads_have_the_layout_of_yolov7(improved):
    heads = YOLOv7(4, improved, improved, width=0.125)(torch.zeros(2, 3, 64, 96))
    assert [tuple(head.shape) for head in heads] == [(2, 3, 8, 12, 9), (2, 3, 4, 6, 9), (2, 3, 2, 3, 9)]


@pytest.mark.parametrize("improved", [False, True])
def test_the_network_for_inference_computes_the_same(improved):
    torch.manual_seed(1)
    network = with_random_statistics(YOLOv7(4, improved, improved, width=0.125))
    images = torch.rand(1, 3, 64, 96)
    with torch.no_grad():
        for before, after in zip(network(images), network.deployed()(images)):
            torch.testing.assert_close(before, after, rtol=1e-3, atol=1e-4)


def test_half_of_the_channels_of_gbs_are_ghosts_of_the_other_half():
    layer = blocks.GBS(8, 16, 3).eval()
    x = torch.rand(1, 8, 6, 6)
    y = layer(x)
    assert y.shape == (1, 16, 6, 6)
    torch.testing.assert_close(y[:, 8:], layer.cheap(y[:, :8]))
    with torch.no_grad():
        layer.cheap.conv.weight[3:] = 0  # a ghost depends on one channel only
    assert (layer(x)[0, 8 + 3:].std((1, 2)) == 0).all()


def test_attention_scales_whole_channels():
    layer = blocks.SE(32)
    x = torch.rand(2, 32, 5, 5) + 0.1
    factors = layer(x) / x
    torch.testing.assert_close(factors, factors[:, :, :1, :1].expand_as(factors))
    assert 0 < factors.min() and factors.max() < 1


@pytest.mark.parametrize("reading", READINGS)
def test_weights_survive_saving(tmp_path, reading):
    network = with_random_statistics(YOLOv7(2, True, True, width=0.125, reading=reading))
    save(network, ["person", "dog"], tmp_path / "a.pt")
    again, names = load(tmp_path / "a.pt")
    assert names == ["person", "dog"]
    images = torch.rand(1, 3, 64, 64)
    torch.testing.assert_close(network(images), again(images))
