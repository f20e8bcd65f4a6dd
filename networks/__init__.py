# SPDX-License-Identifier: Apache-2.0
"""YOLOv7 and its variant with GhostConv and SE attention: definition, training, evaluation and ONNX export."""
