"""Built-in segmentation network: two decoders trained for this project on the features of EfficientNet-Lite0.

The encoder was trained on real photos (ImageNet) and is not trained further. The decoders (feature pyramids, Lin et al. 2017,
with 0.28 million weights) were trained on composites that ``benchmarks/train_object_network.py`` renders from templates. The
second decoder saw more varied composites: it keeps parts in the background's colour and removes hard shadows, but may take a
dark part for a shadow where the first does not. The network is applied twice, to the whole picture and to an enlarged crop
around the object, at two sizes and mirrored. The mean of all outputs has a smaller error than each, and is uncertain where
they differ.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable, Sequence
from functools import cache, partial
from importlib.resources import files

import cv2
import numpy as np

from manitwin.formats.onnx_graph import OnnxGraph
from manitwin.models.classifiers.efficientnet_lite import DEVIATION, MEAN, WEIGHTS_SHA256, load_weights, trunk
from manitwin.models.classifiers.efficientnet_lite import NAME as ENCODER

NAME = "object-network"
WEIGHTS_FILES = ("object_network.npz", "object_network_varied.npz")
"""Files of the decoders' weights."""
SIDE_PX = 288
"""Side of the decoders' training pictures in pixels."""
WAYS = ((288, False), (384, False), (384, True))
"""Passes over a picture: its side in pixels, and whether it is mirrored."""
BLOCKS = (0, 2, 4, 10, 15)
"""Blocks of the encoder after which the feature maps have 1/2, 1/4, 1/8, 1/16 and 1/32 of the input size."""
MIXES = 2
"""Convolutions at each scale except the smallest."""
MARGIN = 0.2
"""Margin around the object in the second pass, as a share of its longer side."""
CLOSER = 1.25
"""Minimum enlargement for which a second pass is made."""
LEAST_SHARE = 0.5
LEAST_PIXELS = 16


def object_share(rgb: np.ndarray) -> np.ndarray:
    """Return the foreground probability (H, W) float32 in [0, 1] of each pixel of ``rgb`` (H, W, 3) uint8 sRGB.

    It is the mean over all ``WAYS``. Raises Unavailable without the encoder's weights.
    """
    # not cached: a network with its buffers takes 85 MB, parsing it takes 0.02 CPU-s
    network = cv2.dnn.readNetFromONNX(np.frombuffer(_content(), np.uint8))
    looks = [
        evaluate_coarse_to_fine(rgb, partial(_network_share, network, side_px=side, mirrored=mirrored))
        for side, mirrored in WAYS
    ]
    return np.asarray(np.mean(looks, axis=0), np.float32)


def evaluate_coarse_to_fine(rgb: np.ndarray, look: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Evaluate ``look`` on a picture and, for a small object, again on an enlarged crop around it; return (H, W) in [0, 1]."""
    share = look(rgb)
    rows, columns = np.nonzero(share > LEAST_SHARE)
    if len(rows) < LEAST_PIXELS:
        return share
    height, width = share.shape
    margin = MARGIN * max(np.ptp(rows), np.ptp(columns)) + 8
    top, left = (max(0, int(low - margin)) for low in (rows.min(), columns.min()))
    bottom, right = min(height, int(rows.max() + margin) + 1), min(width, int(columns.max() + margin) + 1)
    if max(height / (bottom - top), width / (right - left)) < CLOSER:
        return share
    joined = share.copy()
    box = np.s_[top:bottom, left:right]
    joined[box] = look(np.ascontiguousarray(rgb[box]))
    return joined


def _network_share(network: cv2.dnn.Net, rgb: np.ndarray, side_px: int, mirrored: bool) -> np.ndarray:
    shrinks = max(rgb.shape[:2]) > side_px
    picture = cv2.resize(rgb, (side_px, side_px), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
    picture = picture[:, ::-1] if mirrored else picture
    network.setInput(((picture.astype(np.float32) - MEAN) / DEVIATION).transpose(2, 0, 1)[None].copy())
    share = np.asarray(network.forward()[0, 0], np.float32)
    share = np.ascontiguousarray(share[:, ::-1]) if mirrored else share
    return np.asarray(np.clip(cv2.resize(share, rgb.shape[1::-1], interpolation=cv2.INTER_LINEAR), 0, 1))


@cache
def _content() -> bytes:
    """Return the network as ONNX, for pictures of any size; cached (16 MB), because it takes 0.1 CPU-s to build."""
    return network_bytes(load_weights(), [decoder_weights(name) for name in WEIGHTS_FILES])


def built_in_model() -> str:
    """Return the name of the network in a twin's provenance, with the digests of its files."""
    decoders = "+".join(hashlib.sha256(_decoder_file(name)).hexdigest()[:12] for name in WEIGHTS_FILES)
    return f"{NAME} sha256:{decoders} over {ENCODER} sha256:{WEIGHTS_SHA256[:12]}"


def decoder_weights(name: str) -> dict[str, np.ndarray]:
    """Return the weights of one of the ``WEIGHTS_FILES``, float16, by layer name."""
    with np.load(io.BytesIO(_decoder_file(name))) as arrays:
        return dict(arrays)


def _decoder_file(name: str) -> bytes:
    return (files("manitwin.models.matting") / name).read_bytes()


def network_bytes(encoder: dict[str, np.ndarray], decoders: Sequence[dict[str, np.ndarray]]) -> bytes:
    """Return encoder and decoders as ONNX: input ``(1, 3, S, S)`` as the encoder's, output the mean foreground probability.

    The file declares S as ``SIDE_PX``; OpenCV accepts any multiple of 32.
    """
    graph, values = trunk(encoder, SIDE_PX)
    shares = [_decoded(graph, values, decoder, f"decoder{place}") for place, decoder in enumerate(decoders)]
    weight = graph.weight("mean.weight", np.float32(1 / len(shares)).reshape(1))
    parts = [graph.node("Mul", [share, weight], f"mean.part{place}") for place, share in enumerate(shares)]
    total = parts[0]
    for place, part in enumerate(parts[1:]):
        total = graph.node("Add", [total, part], f"mean.sum{place}")
    return graph.to_bytes(total, (1, 1, SIDE_PX, SIDE_PX))


def _decoded(graph: OnnxGraph, values: dict[str, str], decoder: dict[str, np.ndarray], prefix: str) -> str:
    """Add a decoder over the encoder's ``values`` to the graph; return the name of its output, the foreground probability."""

    def convolved(name: str, value: str, *, active: bool = True) -> str:
        kernel = decoder[f"{name}.weight"].astype(np.float32)
        weights = [
            graph.weight(f"{prefix}.{name}.weight", kernel),
            graph.weight(f"{prefix}.{name}.bias", decoder[f"{name}.bias"].astype(np.float32)),
        ]
        side = kernel.shape[-1]
        output = f"{prefix}.{name}"
        graph.node("Conv", [value, *weights], f"{output}.sum", kernel_shape=[side, side], pads=[side // 2] * 4)
        return graph.node("Relu", [f"{output}.sum"], output) if active else f"{output}.sum"

    def twice_as_large(name: str, value: str) -> str:
        region = graph.weight(f"{name}.region", np.zeros(0, np.float32))
        twice = graph.weight(f"{name}.scales", np.array([1, 1, 2, 2], np.float32))
        how = {"mode": "linear", "coordinate_transformation_mode": "half_pixel"}
        return graph.node("Resize", [value, region, twice], f"{name}.larger", **how)

    laterals = [convolved(f"lateral{level}", values[f"_blocks.{block}"]) for level, block in enumerate(BLOCKS)]
    value = convolved("top", laterals[-1])
    for level in reversed(range(len(BLOCKS) - 1)):
        narrowed = convolved(f"narrow{level}", value, active=False)
        larger = twice_as_large(f"{prefix}.level{level}", narrowed)
        value = graph.node("Add", [larger, laterals[level]], f"{prefix}.level{level}.joined")
        for mix in range(MIXES):
            value = convolved(f"mix{level}.{mix}", value)
    quarters = convolved("answer", value, active=False)
    whole = graph.node("DepthToSpace", [quarters], f"{prefix}.whole", blocksize=2, mode="CRD")
    return graph.node("Sigmoid", [whole], f"{prefix}.share")
