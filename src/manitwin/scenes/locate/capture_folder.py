"""Folder with one view of a depth camera, written by ``manitwin capture`` and read by ``manitwin locate --view``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from manitwin.errors import UsageError
from manitwin.formats.image_file import png_of
from manitwin.formats.label_picture import label_picture
from manitwin.formats.output_folder import new_folder

DEPTH, RGB, CAMERA, BASE = "depth.png", "rgb.png", "camera.json", "base.json"
MOST_NUMBER = 65535
"""The largest value of a 16-bit picture."""


@dataclass(frozen=True)
class Capture:
    """One view: ``depth_m (H, W)``, 0 unknown; ``rgb (H, W, 3) uint8`` aligned with it; ``intrinsics (3, 3)`` as in OpenCV.

    ``camera_to_base (4, 4)`` is given if known. ``masks (H, W) bool`` are object masks by name, if there are any. ``device``
    names the camera.
    """

    depth_m: np.ndarray
    depth_unit_m: float
    intrinsics: np.ndarray
    rgb: np.ndarray
    device: str
    camera_to_base: np.ndarray | None = None
    masks: Mapping[str, np.ndarray] = field(default_factory=dict)


def write_capture(out: Path, capture: Capture) -> None:
    """Write a new folder atomically; depths that exceed 16 bits become unknown. Raises UsageError."""
    numbers = np.rint(capture.depth_m / capture.depth_unit_m)
    numbers[~(numbers <= MOST_NUMBER)] = 0
    k, (height, width) = capture.intrinsics, capture.depth_m.shape
    names = ("fx", "fy", "cx", "cy")
    lens = dict(zip(names, (float(each) for each in (k[0, 0], k[1, 1], k[0, 2], k[1, 2])), strict=True))
    camera = {**lens, "width": width, "height": height, "depth_unit_m": capture.depth_unit_m, "device": capture.device}
    with new_folder(out) as folder:
        (folder / DEPTH).write_bytes(label_picture(numbers))
        (folder / RGB).write_bytes(png_of(capture.rgb))
        (folder / CAMERA).write_text(json.dumps(camera, indent=1) + "\n")
        if capture.camera_to_base is not None:
            base = {"camera_to_base": capture.camera_to_base.round(9).tolist()}
            (folder / BASE).write_text(json.dumps(base, indent=1) + "\n")
        for name, mask in capture.masks.items():
            (folder / f"mask_{name}.png").write_bytes(label_picture(mask * 255))


def capture_files(folder: Path) -> dict[str, Path]:
    """Return the files of a folder by option of ``manitwin locate``: depth, camera, and rgb and base if they exist.

    Raises UsageError if a required one is missing.
    """
    for name in (DEPTH, CAMERA):
        if not (folder / name).is_file():
            raise UsageError(f"{folder}: has no {name}; give a folder that manitwin capture wrote")
    named = {"depth": DEPTH, "camera": CAMERA, "rgb": RGB, "base": BASE}
    return {option: folder / name for option, name in named.items() if (folder / name).is_file()}
