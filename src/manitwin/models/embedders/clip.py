"""CLIP and similar models from a folder of ONNX files: pictures, texts and point clouds as vectors in one space.

Radford et al. 2021, "Learning transferable visual models from natural language supervision"; ULIP (Xue et al. 2023) adds a
network for point clouds. The folder has the layout that Hugging Face uses for ONNX models: ``vision_model.onnx``,
``text_model.onnx`` (at the top or in ``onnx/``), ``preprocessor_config.json``, ``vocab.json`` and ``merges.txt``; ULIP adds
``point_model.onnx``. OpenCV runs the networks on the CPU; no other runtime is needed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from manitwin.errors import UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.isolated import Limits, ProcessCrashed, run_isolated
from manitwin.formats.json_file import json_number, json_vector, read_json_object
from manitwin.formats.onnx_file import MAX_ONNX_BYTES, parse_onnx
from manitwin.formats.printable import printable_line
from manitwin.models.embedders.clip_tokens import LENGTH, ClipTokens

VISION, TEXT, POINTS = "vision_model.onnx", "text_model.onnx", "point_model.onnx"
OUTPUTS = {VISION: "image_embeds", TEXT: "text_embeds", POINTS: "point_embeds"}
"""Name of a network's embedding, used if the network has several outputs."""
PREPROCESSOR = "preprocessor_config.json"
FLOAT, INT64 = 1, 7
POINT_COUNT = 8192
"""Number of points of ULIP's backbones, used if the network leaves it open."""
MOST_TOKENS, MOST_POINTS = 4096, 1 << 17
LIMITS = Limits(seconds=300.0, memory_bytes=12 << 30)
"""Limits of a network's test run, the same as for matting networks."""
_FEW = "give a folder with vision_model.onnx, text_model.onnx, preprocessor_config.json, vocab.json and merges.txt"


class ClipFolder:
    """The networks of a folder, each loaded when it is first used; all vectors have unit length."""

    def __init__(self, folder: Path, *, points: bool = False):
        """Check that the files exist, with ``points`` also a point-cloud network; raises UsageError for a missing file."""
        self.folder = folder
        self._networks: dict[str, _Network] = {}
        self._tried: set[str] = set()
        for name in (VISION, TEXT, *([POINTS] if points else [])):
            self._path(name)
        for name in (PREPROCESSOR, "vocab.json", "merges.txt"):
            if not (folder / name).is_file():
                raise UsageError(f"{folder / name}: not found; {_FEW}")

    @property
    def name(self) -> str:
        """Name of the model: the name of its folder."""
        return self.folder.resolve().name

    @cached_property
    def sha256(self) -> dict[str, str]:
        """SHA-256 of each file that affects the vectors, by file name."""
        files = [self._path(name) for name in (VISION, TEXT, POINTS) if self._find_file(name) is not None]
        files += [self.folder / name for name in (PREPROCESSOR, "vocab.json", "merges.txt")]
        return {path.name: hashlib.sha256(read_bytes(path, MAX_ONNX_BYTES, UsageError)).hexdigest() for path in files}

    def pictures(self, pictures: Sequence[np.ndarray]) -> np.ndarray:
        """Return the unit vectors ``(N, D)`` of pictures ``(H, W, 3) uint8`` sRGB."""
        return self._unit([self._run(VISION, self._preprocess(picture)) for picture in pictures])

    def texts(self, texts: Sequence[str]) -> np.ndarray:
        """Return the unit vectors ``(N, D)`` of texts."""
        network = self._network(TEXT)
        length = (network.shape[-1] if network.shape else None) or LENGTH
        if not 2 <= length <= MOST_TOKENS:
            raise UsageError(f"{network.path}: takes texts of {length} tokens; 2 to {MOST_TOKENS} are supported")
        return self._unit([self._run(TEXT, self._tokens.encode(text, length)[None]) for text in texts])

    def points(self, points_m: np.ndarray) -> np.ndarray:
        """Return the unit vector ``(D,)`` of surface points ``(N, 3)`` with +Z up.

        They are transformed to ULIP's convention: +Y up, centred, scaled into the unit ball.
        """
        turned = np.stack([points_m[:, 0], points_m[:, 2], -points_m[:, 1]], axis=1)
        centered = turned - turned.mean(0)
        ball = centered / max(float(np.linalg.norm(centered, axis=1).max()), 1e-12)
        return np.asarray(self._unit([self._run(POINTS, ball[None].astype(np.float32))])[0])

    @property
    def point_count(self) -> int:
        """Number of points that the network takes."""
        shape = self._network(POINTS).shape
        if len(shape) != 3 or shape[2] not in (3, None):
            raise UsageError(f"{POINTS}: takes {shape}, not (1, N, 3); give a network of points without colours")
        count = shape[1] or POINT_COUNT
        if not 1 <= count <= MOST_POINTS:
            raise UsageError(f"{POINTS}: takes {count} points; at most {MOST_POINTS} are supported")
        return count

    @cached_property
    def _tokens(self) -> ClipTokens:
        return ClipTokens.of_folder(self.folder)

    @cached_property
    def _scaling(self) -> tuple[int, np.ndarray, np.ndarray]:
        """Side in pixels, mean and standard deviation from ``preprocessor_config.json``."""
        path = self.folder / PREPROCESSOR
        said = read_json_object(path, UsageError)
        try:
            size = said.get("crop_size", said.get("size"))
            if isinstance(size, dict):
                size = size.get("height", size.get("shortest_edge"))
            side = int(json_number(size, "crop_size"))
            mean, deviation = (json_vector(said[key], 3, key) for key in ("image_mean", "image_std"))
        except (KeyError, TypeError, ValueError, UsageError) as error:
            raise UsageError(f"{path}: lacks crop_size, image_mean or image_std ({error}); {_FEW}") from error
        if not 8 <= side <= 2048 or (deviation <= 0).any():
            raise UsageError(f"{path}: pictures of {side} px with deviation {deviation.tolist()} cannot be; {_FEW}")
        return side, mean.astype(np.float32), deviation.astype(np.float32)

    def _preprocess(self, picture: np.ndarray) -> np.ndarray:
        """Scale the shorter side bicubically, crop the centre, and standardize, as CLIP's preprocessor does."""
        side, mean, deviation = self._scaling
        height, width = picture.shape[:2]
        factor = side / min(height, width)
        size = (max(side, int(width * factor)), max(side, int(height * factor)))
        scaled = np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.BICUBIC), np.float32)
        top, left = (size[1] - side) // 2, (size[0] - side) // 2
        square = scaled[top : top + side, left : left + side] / 255
        return np.ascontiguousarray(((square - mean) / deviation).transpose(2, 0, 1)[None])

    def _unit(self, rows: Sequence[np.ndarray]) -> np.ndarray:
        vectors = np.array(rows, np.float64)
        lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
        if not np.isfinite(vectors).all() or not (lengths > 0).all():
            raise UsageError(f"{self.folder}: its networks return vectors that are not finite; give another model")
        return np.asarray(vectors / lengths)

    def _find_file(self, name: str) -> Path | None:
        return next((path for path in (self.folder / name, self.folder / "onnx" / name) if path.is_file()), None)

    def _path(self, name: str) -> Path:
        path = self._find_file(name)
        if path is None:
            raise UsageError(f"{self.folder / name}: not found, also not in onnx/; {_FEW}")
        return path

    def _network(self, name: str) -> _Network:
        if name not in self._networks:
            self._networks[name] = _Network(self._path(name), OUTPUTS[name])
        return self._networks[name]

    def _run(self, name: str, value: np.ndarray) -> np.ndarray:
        if name not in self._tried:
            _check_runs(self._path(name), OUTPUTS[name], value)
            self._tried.add(name)
        return self._network(name).run(value)


def _check_runs(path: Path, output: str, value: np.ndarray) -> None:
    """Run a network once in a subprocess, because OpenCV crashes on some broken networks."""
    try:
        run_isolated("manitwin.models.embedders.clip:run_once", path, output, value, limits=LIMITS)
    except (ProcessCrashed, MemoryError) as error:
        cause = printable_line(str(error) or "more memory than it may take", max_characters=160)
        raise UsageError(f"{path}: cannot be run here ({cause}); give another export of the network") from error


def run_once(path: Path, output: str, value: np.ndarray) -> None:
    """Load a network and run it on one input; raises UsageError if OpenCV cannot run it."""
    _Network(path, output).run(value)


class _Network:
    """A network with one input, apart from an attention mask of ones, and a vector as output."""

    def __init__(self, path: Path, output: str):
        content = read_bytes(path, MAX_ONNX_BYTES, UsageError)
        parsed = parse_onnx(content, path.name, UsageError, output=output)
        self.path = path
        self._masks = [each.name for each in parsed.inputs if each.name == "attention_mask"]
        rest = [each for each in parsed.inputs if each.name != "attention_mask"]
        if len(rest) != 1 or rest[0].element not in (FLOAT, INT64):
            told = ", ".join(f"{each.name} {each.shape}" for each in parsed.inputs)
            raise UsageError(
                f"{path}: takes {told or 'nothing'}; give a network of one input, exported with 32-bit floats and int64"
            )
        self.input, self.shape = rest[0].name, rest[0].shape
        self._content = parsed.content

    @cached_property
    def _net(self) -> cv2.dnn.Net:
        return cv2.dnn.readNetFromONNX(np.frombuffer(self._content, np.uint8))

    def run(self, value: np.ndarray) -> np.ndarray:
        """Return the vector ``(D,)`` of one input; raises UsageError if OpenCV cannot run the network."""
        try:
            self._net.setInput(np.ascontiguousarray(value), self.input)
            for mask in self._masks:
                self._net.setInput(np.ones(value.shape, np.int64), mask)
            answer = np.asarray(self._net.forward(), np.float64)
        except cv2.error as error:
            raise self._refused(error) from error
        if answer.size != answer.shape[-1]:
            raise UsageError(
                f"{self.path}: its answer of shape {answer.shape} is not a vector; give an embedding network"
            )
        return answer.ravel()

    def _refused(self, error: Exception) -> UsageError:
        cause = printable_line(str(error).splitlines()[0] if str(error) else "no cause", max_characters=160)
        return UsageError(f"{self.path}: OpenCV cannot run it ({cause}); give another export of the network")
