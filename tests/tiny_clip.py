"""A CLIP of a few random weights as its exporters write it, and the same computed by numpy: an independent truth.

The architecture is that of CLIP (Radford et al. 2021) as Hugging Face has it: a vision transformer whose class token is
projected, and a text transformer with a causal mask whose end token is. Normalisations and QuickGELU are written out, as opset
13 has them.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.formats.onnx_graph import OnnxGraph
from manitwin.models.embedders.clip_tokens import _BYTES, BEGIN, END, LENGTH

SIDE, PATCH, WIDTH, HEADS, LAYERS, SPACE = 16, 8, 8, 2, 2, 6
MEAN, DEVIATION = (0.481, 0.458, 0.408), (0.269, 0.261, 0.276)
Weights = dict[str, np.ndarray]


def vocabulary() -> tuple[dict[str, int], list[str]]:
    """All single characters, with and without a word's end, and three merges; the end has the highest number, as CLIP's has."""
    merges = ["m u", "mu g</w>", "r e"]
    tokens = [*_BYTES.values(), *(character + "</w>" for character in _BYTES.values())]
    tokens += [merge.replace(" ", "") for merge in merges] + [BEGIN, END]
    return {token: place for place, token in enumerate(tokens)}, merges


def random_weights(seed: int, tokens: int) -> Weights:
    rng = np.random.default_rng(seed)
    made: Weights = {}

    def draw(name: str, *shape: int) -> None:
        made[name] = rng.normal(0, 0.4, shape).astype(np.float32)

    patches = (SIDE // PATCH) ** 2
    draw("v.patch", WIDTH, 3, PATCH, PATCH), draw("v.class", 1, 1, WIDTH), draw("v.place", 1, patches + 1, WIDTH)
    draw("t.token", tokens, WIDTH), draw("t.place", 1, LENGTH, WIDTH)
    for side in "vt":
        for layer in range(LAYERS):
            for name in ("q", "k", "v", "o"):
                draw(f"{side}.{layer}.{name}.w", WIDTH, WIDTH), draw(f"{side}.{layer}.{name}.b", WIDTH)
            draw(f"{side}.{layer}.up.w", WIDTH, 4 * WIDTH), draw(f"{side}.{layer}.up.b", 4 * WIDTH)
            draw(f"{side}.{layer}.down.w", 4 * WIDTH, WIDTH), draw(f"{side}.{layer}.down.b", WIDTH)
            for norm in ("n1", "n2"):
                draw(f"{side}.{layer}.{norm}.w", WIDTH), draw(f"{side}.{layer}.{norm}.b", WIDTH)
        for norm in ("before", "after"):
            draw(f"{side}.{norm}.w", WIDTH), draw(f"{side}.{norm}.b", WIDTH)
        draw(f"{side}.projection", WIDTH, SPACE)
    return made


class _Numpy:
    """The operators on arrays."""

    def __init__(self, weights: Weights):
        self.weights = weights

    def weight(self, name: str, value: Any = None) -> Any:
        return self.weights[name] if value is None else np.asarray(value)

    def op(self, kind: str, *values: Any, **said: Any) -> Any:
        a, b = values[0], values[1] if len(values) > 1 else None
        if kind == "ReduceMean":
            return a.mean(-1, keepdims=True)
        if kind == "Softmax":
            powers = np.exp(a - a.max(-1, keepdims=True))
            return powers / powers.sum(-1, keepdims=True)
        if kind == "Sigmoid":
            return 1 / (1 + np.exp(-a))
        if kind == "Reshape":
            return a.reshape([int(n) for n in b])
        if kind == "Transpose":
            return a.transpose(said["perm"])
        return {"Add": np.add, "Sub": np.subtract, "Mul": np.multiply, "Div": np.divide, "MatMul": np.matmul}.get(
            kind, lambda *_: np.sqrt(a)
        )(*values)


class _Graph:
    """The same operators as nodes of an ONNX file."""

    def __init__(self, weights: Weights, graph: OnnxGraph):
        self.weights, self.graph, self.count = weights, graph, 0

    def weight(self, name: str, value: Any = None) -> str:
        return self.graph.weight(name, self.weights[name] if value is None else np.asarray(value))

    def op(self, kind: str, *values: Any, **said: Any) -> str:
        self.count += 1
        return self.graph.node(kind, list(values), f"value_{self.count}", **said)


def _norm(on: Any, value: Any, name: str) -> Any:
    centered = on.op("Sub", value, on.op("ReduceMean", value, axes=[-1], keepdims=1))
    square = on.op("ReduceMean", on.op("Mul", centered, centered), axes=[-1], keepdims=1)
    root = on.op("Sqrt", on.op("Add", square, on.weight(f"{name}.e", np.float32(1e-5))))
    return on.op("Add", on.op("Mul", on.op("Div", centered, root), on.weight(f"{name}.w")), on.weight(f"{name}.b"))


def _dense(on: Any, value: Any, name: str) -> Any:
    return on.op("Add", on.op("MatMul", value, on.weight(f"{name}.w")), on.weight(f"{name}.b"))


def _encoder(on: Any, value: Any, side: str, length: int, mask: bool) -> Any:
    for layer in range(LAYERS):
        name = f"{side}.{layer}"
        normed = _norm(on, value, f"{name}.n1")
        split = on.weight(f"{name}.split", np.array([1, length, HEADS, WIDTH // HEADS]))
        heads = [
            on.op("Transpose", on.op("Reshape", _dense(on, normed, f"{name}.{each}"), split), perm=[0, 2, 1, 3])
            for each in "qkv"
        ]
        scores = on.op("MatMul", heads[0], on.op("Transpose", heads[1], perm=[0, 1, 3, 2]))
        scores = on.op("Mul", scores, on.weight(f"{name}.scale", np.float32((WIDTH // HEADS) ** -0.5)))
        if mask:
            causal = np.triu(np.full((1, 1, length, length), -1e9, np.float32), 1)
            scores = on.op("Add", scores, on.weight(f"{name}.mask", causal))
        seen = on.op("Transpose", on.op("MatMul", on.op("Softmax", scores, axis=-1), heads[2]), perm=[0, 2, 1, 3])
        joined = on.op("Reshape", seen, on.weight(f"{name}.join", np.array([1, length, WIDTH])))
        value = on.op("Add", value, _dense(on, joined, f"{name}.o"))
        up = _dense(on, _norm(on, value, f"{name}.n2"), f"{name}.up")
        gate = on.op("Sigmoid", on.op("Mul", up, on.weight(f"{name}.quick", np.float32(1.702))))
        value = on.op("Add", value, _dense(on, on.op("Mul", up, gate), f"{name}.down"))
    return value


def vision_onnx(weights: Weights) -> bytes:
    graph = OnnxGraph((1, 3, SIDE, SIDE), "pixel_values")
    on, patches = _Graph(weights, graph), (SIDE // PATCH) ** 2
    conv = on.op("Conv", "pixel_values", on.weight("v.patch"), kernel_shape=[PATCH, PATCH], strides=[PATCH, PATCH])
    flat = on.op(
        "Transpose", on.op("Reshape", conv, on.weight("v.flat", np.array([1, WIDTH, patches]))), perm=[0, 2, 1]
    )
    value = on.op("Add", on.op("Concat", on.weight("v.class"), flat, axis=1), on.weight("v.place"))
    value = _encoder(on, _norm(on, value, "v.before"), "v", patches + 1, False)
    first = on.op("Gather", value, on.weight("v.first", np.array(0)), axis=1)
    graph.node("MatMul", [_norm(on, first, "v.after"), on.weight("v.projection")], "image_embeds")
    return graph.to_bytes("image_embeds", (1, SPACE))


def vision_vector(weights: Weights, pixels: np.ndarray) -> np.ndarray:
    """The vector of ``pixels (3, SIDE, SIDE)`` that are standardised, by numpy."""
    on, n = _Numpy(weights), SIDE // PATCH
    patches = pixels.reshape(3, n, PATCH, n, PATCH).transpose(1, 3, 0, 2, 4).reshape(n * n, -1)
    flat = (patches @ weights["v.patch"].reshape(WIDTH, -1).T)[None]
    value = np.concatenate([weights["v.class"], flat], axis=1) + weights["v.place"]
    value = _encoder(on, _norm(on, value, "v.before"), "v", n * n + 1, False)
    return np.asarray(_norm(on, value[:, 0], "v.after") @ weights["v.projection"])[0]


def text_onnx(weights: Weights) -> bytes:
    graph = OnnxGraph((1, LENGTH), "input_ids", whole=True)
    on = _Graph(weights, graph)
    value = on.op("Add", on.op("Gather", on.weight("t.token"), "input_ids", axis=0), on.weight("t.place"))
    value = _norm(on, _encoder(on, value, "t", LENGTH, True), "t.after")
    end = on.op("ArgMax", "input_ids", axis=-1, keepdims=0)
    last = on.op("Reshape", on.op("Gather", value, end, axis=1), on.weight("t.one", np.array([1, WIDTH])))
    graph.node("MatMul", [last, on.weight("t.projection")], "text_embeds")
    return graph.to_bytes("text_embeds", (1, SPACE))


def text_vector(weights: Weights, ids: np.ndarray) -> np.ndarray:
    """The vector of ``ids (LENGTH,)``, by numpy."""
    on = _Numpy(weights)
    value = weights["t.token"][ids][None] + weights["t.place"]
    value = _norm(on, _encoder(on, value, "t", LENGTH, True), "t.after")
    return np.asarray(value[0, ids.argmax()] @ weights["t.projection"])


def point_onnx(weights: Weights, count: int = 64) -> bytes:
    """A network of points: two layers on each, the mean, a projection (PointNet without its transforms)."""
    graph = OnnxGraph((1, count, 3), "points")
    on = _Graph(weights, graph)
    first = on.op("Sigmoid", on.op("MatMul", "points", on.weight("p.w", point_weight())))
    mean = on.op("ReduceMean", first, axes=[1], keepdims=0)
    graph.node("MatMul", [mean, on.weight("v.projection")], "point_embeds")
    return graph.to_bytes("point_embeds", (1, SPACE))


def point_weight() -> np.ndarray:
    return np.random.default_rng(5).normal(0, 2, (3, WIDTH)).astype(np.float32)


def write_tiny_clip(folder: Path, *, seed: int = 0, points: bool = False) -> Weights:
    """Write the folder of a model; returns its weights."""
    (folder / "onnx").mkdir(parents=True)
    tokens, merges = vocabulary()
    weights = random_weights(seed, len(tokens))
    (folder / "onnx" / "vision_model.onnx").write_bytes(vision_onnx(weights))
    (folder / "onnx" / "text_model.onnx").write_bytes(text_onnx(weights))
    if points:
        (folder / "onnx" / "point_model.onnx").write_bytes(point_onnx(weights))
    said = {"crop_size": {"height": SIDE, "width": SIDE}, "image_mean": MEAN, "image_std": DEVIATION}
    (folder / "preprocessor_config.json").write_text(json.dumps(said))
    (folder / "vocab.json").write_text(json.dumps(tokens))
    (folder / "merges.txt").write_text("#version: 0.2\n" + "\n".join(merges) + "\n")
    return weights
