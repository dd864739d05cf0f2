"""Matting networks that the user adds or names, in addition to the built-in one, run by OpenCV on the CPU.

Supported are networks for salient object detection and dichotomous segmentation that take one picture and return the
foreground probability of each pixel as first output: U2-Net (320 px), IS-Net (1024 px), BiRefNet (1024 px, with logits as
output).
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from manitwin.errors import BadReply, UsageError, unknown_name_message
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.formats.onnx_file import MAX_ONNX_BYTES, OnnxFile, parse_onnx
from manitwin.formats.printable import printable_line
from manitwin.models.weights.catalog import KNOWN_WEIGHTS
from manitwin.models.weights.store import find_stored, read_stored

Scaling = Literal["half", "imagenet"]
SCALINGS: dict[Scaling, tuple[np.ndarray, np.ndarray]] = {
    "half": (np.full(3, 128, np.float32), np.full(3, 256, np.float32)),
    "imagenet": (np.array([123.675, 116.28, 103.53], np.float32), np.array([58.395, 57.12, 57.375], np.float32)),
}
"""Mean and divisor of 8-bit RGB: ``half`` for IS-Net, ``imagenet`` (ImageNet statistics) for U2-Net and BiRefNet."""
LEAST_SIDE_PX, MOST_SIDE_PX, USUAL_SIDE_PX = 64, 2048, 1024
LIMITS = Limits(seconds=300.0, memory_bytes=12 << 30)
SUFFIX = ".onnx"
NONE = "none"
MOST_NETWORKS = 2
"""Maximum number of networks that the user may name; of two, the agreement is evaluated."""


@dataclass(frozen=True)
class Network:
    """A matting network in an ONNX ``file`` with this ``sha256``; ``source`` and ``licence`` are recorded as provenance.

    ``side_px`` is the height and width of its input.
    """

    name: str
    file: Path
    sha256: str
    side_px: tuple[int, int]
    scaling: Scaling
    source: str
    licence: str

    @property
    def model(self) -> str:
        """Name of the network in a twin's provenance."""
        return f"{self.name} sha256:{self.sha256[:12]}"


def find_networks(names: str) -> tuple[Network, ...]:
    """Return the networks of a comma-separated list of names, at most ``MOST_NETWORKS``; ``none`` stands for no network.

    Raises UsageError as ``find_network``, and for too many or repeated networks.
    """
    said = [name.strip() for name in names.split(",")]
    if said == [NONE]:
        return ()
    if NONE in said:
        raise UsageError(f"matting {printable_line(names)!r}: {NONE!r} cannot be combined; leave it out, or the others")
    found = tuple(find_network(name) for name in said)
    if len(found) > MOST_NETWORKS or len({network.sha256 for network in found}) < len(found):
        raise UsageError(
            f"matting {printable_line(names)!r}: asks {len(found)} networks; give at most {MOST_NETWORKS} different"
            f" ones"
        )
    return found


@lru_cache(maxsize=4)
def find_network(name: str) -> Network:
    """Return a network by the name of added weights or the path of an ONNX file; raises UsageError if there is none."""
    if name.endswith(SUFFIX):
        path = Path(name)
        content = read_bytes(path, MAX_ONNX_BYTES, UsageError, name=name)
        return _network(
            path.stem, path.absolute(), content, source=f"file:{path.name}", licence="as its user said: none"
        )
    if name not in KNOWN_WEIGHTS:
        raise UsageError(unknown_name_message("matting", name, [NONE, *KNOWN_WEIGHTS]) + f", or an {SUFFIX} file")
    added = find_stored(name)
    if added is None:
        raise UsageError(
            f"matting {name!r}: its weights are not installed; install them with manitwin models add {name}"
        )
    return _network(name, added.path, read_stored(added), source=added.source, licence=added.licence)


def _network(name: str, file: Path, content: bytes, *, source: str, licence: str) -> Network:
    parsed = parse_onnx(content, file.name, UsageError)
    side_px = _input_size(parsed, file.name)
    scaling: Scaling = "imagenet" if max(side_px) < 512 or "birefnet" in name.lower() else "half"
    return Network(name, file, hashlib.sha256(content).hexdigest(), side_px, scaling, source, licence)


def _input_size(parsed: OnnxFile, called: str) -> tuple[int, int]:
    """Return height and width of the single picture that a network takes; raises UsageError for other inputs."""
    remedy = "give a matting network such as U2-Net, IS-Net or BiRefNet: one picture in, one mask out"
    if len(parsed.inputs) != 1 or len(parsed.inputs[0].shape) != 4 or parsed.inputs[0].shape[1] not in (3, None):
        shapes = ", ".join(str(tensor.shape) for tensor in parsed.inputs[:4])
        raise UsageError(
            f"{printable_line(called)}: its inputs are {shapes or 'none'}, not one of (1, 3, H, W); {remedy}"
        )
    height, width = (size or USUAL_SIDE_PX for size in parsed.inputs[0].shape[2:])
    if not all(LEAST_SIDE_PX <= side <= MOST_SIDE_PX for side in (height, width)):
        raise UsageError(
            f"{printable_line(called)}: takes pictures of {width} x {height} px; {LEAST_SIDE_PX} to {MOST_SIDE_PX} are run"
        )
    return height, width


def require_working(network: Network) -> None:
    """Run a network once in a subprocess; raises UsageError if it cannot be run, hangs, or crashes the process."""
    grey = np.full((64, 64, 3), 128, np.uint8)
    try:
        run_isolated("manitwin.models.matting.learned:learned_alpha", network, grey, limits=LIMITS)
    except (ProcessCrashed, MemoryError, BadReply) as error:
        cause = printable_line(str(error) or "more memory than it may take", max_characters=200)
        raise UsageError(f"{network.file.name}: cannot be run here ({cause}); give another network") from error


def learned_alpha(network: Network, rgb: np.ndarray) -> np.ndarray:
    """Return a network's foreground probability (H, W) float32 in [0, 1] for ``rgb`` (H, W, 3) uint8.

    Raises BadReply if OpenCV cannot run the network or its output is not a mask.
    """
    net = _loaded(network.file, network.sha256)
    mean, divisor = SCALINGS[network.scaling]
    height, width = network.side_px
    picture = cv2.resize(rgb, (width, height), interpolation=cv2.INTER_LINEAR).astype(np.float32)
    blob = np.ascontiguousarray(((picture - mean) / divisor).transpose(2, 0, 1)[None])
    try:
        net.setInput(blob)
        answer = np.asarray(net.forward(), np.float32)
    except cv2.error as error:
        raise BadReply(f"{network.name}: OpenCV cannot run it ({_cause(error)}); give another network") from error
    mask = np.squeeze(answer)
    if mask.ndim != 2 or min(mask.shape) < 8 or not np.isfinite(mask).all():
        raise BadReply(f"{network.name}: its answer of shape {answer.shape} is not a mask; give another network")
    if mask.min() < -0.01 or mask.max() > 1.01:  # logits
        mask = np.asarray(1 / (1 + np.exp(-np.clip(mask, -30, 30))), np.float32)
    return np.asarray(np.clip(cv2.resize(mask, rgb.shape[1::-1], interpolation=cv2.INTER_LINEAR), 0, 1))


@lru_cache(maxsize=MOST_NETWORKS)  # hundreds of megabytes each
def _loaded(file: Path, sha256: str) -> cv2.dnn.Net:
    content = read_bytes(file, MAX_ONNX_BYTES, UsageError)
    if hashlib.sha256(content).hexdigest() != sha256:
        raise UsageError(f"{file}: has changed since the build began; start it again")
    ordered = parse_onnx(content, file.name, UsageError).content
    try:
        return cv2.dnn.readNetFromONNX(np.frombuffer(ordered, np.uint8))
    except cv2.error as error:
        raise BadReply(f"{file.name}: OpenCV cannot load it ({_cause(error)}); give another network") from error


def _cause(error: Exception) -> str:
    return printable_line(str(error).splitlines()[0] if str(error) else type(error).__name__, max_characters=160)
