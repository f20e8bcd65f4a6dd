#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of quantize_network.py on a small network: two convolutions with an activation and a last one
without. Exit code 77 ("skipped" for ctest) if the packages of the script are not installed."""
import contextlib
import io
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import numpy as np
    import onnx
    import onnxruntime
    from onnx import TensorProto, helper, numpy_helper
    from PIL import Image
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

import quantize_network

RANDOM = np.random.default_rng(1)
BOXES = 6 * 8  # a box per pixel of the last layer


def convolution(name, inputs, channels, before, size=0.3):
    weights = RANDOM.normal(0, size, (channels, before, 3, 3)).astype(np.float32)
    weights[0] *= 4  # one scale for all channels would leave the others little
    node = helper.make_node("Conv", [inputs, name + "_w"], [name], name=name, pads=[1] * 4, strides=[2, 2])
    return node, numpy_helper.from_array(weights, name + "_w")


def silu(name):
    return [helper.make_node("Sigmoid", [name], [name + "_s"], name=name + "_s"),
            helper.make_node("Mul", [name, name + "_s"], [name + "_a"], name=name + "_a")]


def network(file, operators=12, height=48):
    first, w1 = convolution("first", "images", 8, 3)
    second, w2 = convolution("second", "first_a", 8, 8)
    last, w3 = convolution("last", "second_a", 84, 8, size=1e-4)  # no sure box
    shape = numpy_helper.from_array(np.array([1, 84, BOXES]), "shape")
    flat = helper.make_node("Reshape", ["last", "shape"], ["output0"], name="flat")
    graph = helper.make_graph(
        [first, *silu("first"), second, *silu("second"), last, flat], "small",
        [helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, height, 64])],
        [helper.make_tensor_value_info("output0", TensorProto.FLOAT, [1, 84, BOXES])], [w1, w2, w3, shape])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", operators)], ir_version=7)
    helper.set_model_props(model, {"names": "{0: 'person'}"})
    onnx.save(model, file)


class Quantized(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.model, self.out = self.folder / "small.onnx", self.folder / "small_int8.onnx"
        network(self.model)
        for i in range(24):
            pixels = RANDOM.integers(0, 256, (48, 64, 3), dtype=np.uint8)
            Image.fromarray(pixels).save(self.folder / f"{i:02}.png")

    def run_script(self, *words):
        sys.argv = ["quantize_network.py", *map(str, words)]
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            quantize_network.main()
        return printed.getvalue()

    def producers(self, model):
        return {output: node for node in model.graph.node for output in node.output}

    def test_what_an_activation_follows_computes_with_integers_and_the_last_layer_does_not(self):
        self.run_script(self.model, self.folder, "--out", self.out)
        model = onnx.load(self.out)
        made_by = self.producers(model)
        for node in (n for n in model.graph.node if n.op_type == "Conv"):
            of_integers = [i in made_by and made_by[i].op_type == "DequantizeLinear" for i in node.input[:2]]
            self.assertEqual(of_integers, [node.name != "last"] * 2, node.name)

    def test_it_computes_nearly_the_same(self):
        self.run_script(self.model, self.folder, "--out", self.out)
        image = quantize_network.letterboxed(self.folder / "03.png", 48, 64)
        before, after = (onnxruntime.InferenceSession(str(f), providers=["CPUExecutionProvider"]).run(
            None, {"images": image})[0] for f in (self.model, self.out))
        self.assertLess(np.abs(after - before).mean(), 0.1 * np.abs(before).mean())

    def test_half_converts_the_layers_to_16_bit_floats_and_neither_input_nor_outputs(self):
        out = self.folder / "small_fp16.onnx"
        self.run_script(self.model, self.folder, "--half")
        model = onnx.load(out)
        self.assertEqual({w.data_type for w in model.graph.initializer if "_w" in w.name}, {TensorProto.FLOAT16})
        self.assertEqual([(p.key, p.value) for p in model.metadata_props], [("names", "{0: 'person'}")])
        image = quantize_network.letterboxed(self.folder / "03.png", 48, 64)
        before, after = (onnxruntime.InferenceSession(str(f), providers=["CPUExecutionProvider"]).run(
            None, {"images": image})[0] for f in (self.model, out))
        self.assertEqual(after.dtype, np.float32)
        self.assertLess(np.abs(after - before).mean(), 0.01 * np.abs(before).mean())

    def test_the_classes_names_are_kept(self):
        self.run_script(self.model, self.folder)
        self.assertEqual([(p.key, p.value) for p in onnx.load(self.out).metadata_props], [("names", "{0: 'person'}")])

    def test_few_images_or_an_open_size_are_errors_with_a_fix(self):
        (self.folder / "few").mkdir()
        with self.assertRaisesRegex(SystemExit, "0 images.*fix: give folders"):
            self.run_script(self.model, self.folder / "few")
        network(self.model, height=None)
        with self.assertRaisesRegex(SystemExit, "size open; fix: export"):
            self.run_script(self.model, self.folder)
        with self.assertRaisesRegex(SystemExit, "gone is missing"):
            self.run_script(self.model, self.folder / "gone")


class Parts(unittest.TestCase):
    def test_an_image_is_centered_in_gray(self):
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            Image.new("RGB", (640, 480), (255, 0, 0)).save(file.name)
            x = quantize_network.letterboxed(file.name, 256, 320)
        self.assertEqual(x.shape, (1, 3, 256, 320))
        np.testing.assert_allclose(x[0, 0, :, 7], [114 / 255] * 8 + [1] * 240 + [114 / 255] * 8, rtol=1e-6)

    def test_boxes_are_counted_that_both_networks_find(self):
        box, shifted, elsewhere = (np.array([[x, 0, x + 10.0, 10]]) for x in (0, 1, 50))
        self.assertEqual(quantize_network.found_again(box, np.concatenate([elsewhere, shifted])), (1, 1))
        self.assertEqual(quantize_network.found_again(box, elsewhere), (0, 1))
        self.assertEqual(quantize_network.found_again(box, np.empty((0, 4))), (0, 1))


if __name__ == "__main__":
    unittest.main()
