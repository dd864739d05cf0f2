"""A data set with two photos whose cut-outs are doubted and one that shows nothing: quickly made, as nothing comes after that."""

from __future__ import annotations

import shutil
from pathlib import Path

from PIL import Image

import manitwin
from manitwin.config import BuildConfig, MattingConfig

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "bottle.jpg"
DOUBTING = BuildConfig(
    matting=MattingConfig(min_confidence=0.985).model_dump(),
    grasps={"simulated": 8, "unfiltered": 0, "least_per_point": 2, "tries_per_point": 4},
    second_opinion={"enabled": False}, robustness={"enabled": False},
)  # fmt: skip
"""Believes in no cut-out, and tries few grasps of what is drawn."""


def write_doubted(folder: Path) -> Path:
    """Return the data set, below a folder that has the photos."""
    photos = folder / "photos"
    photos.mkdir(parents=True)
    for name in ("first.jpg", "second.jpg"):
        shutil.copy(SAMPLE, photos / name)
    Image.new("RGB", (400, 300), (200, 200, 200)).save(photos / "bare.png")
    manifest = folder / "list.csv"
    manifest.write_text("file,name\nphotos/first.jpg,bottle\nphotos/second.jpg,water bottle\nphotos/bare.png,cup\n")
    results = manitwin.build(manifest, folder / "twins", config=DOUBTING, executor="inline").results
    assert [each.status for each in results] == ["rejected"] * 3
    return folder / "twins"
