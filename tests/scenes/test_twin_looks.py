"""Looks of twins that are kept from scene to scene."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drawn_scenes import write_scenes
from manitwin.errors import TwinError
from manitwin.scenes.twin_surfaces import raycast_shape, simplified_twin_drawable, twin_drawable
from manitwin.twin.store import RECORD


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_scenes(tmp_path)
    return next((tmp_path / "set").rglob(RECORD)).parent


def test_looks_are_read_once(folder: Path) -> None:
    assert twin_drawable(folder, 128) is twin_drawable(folder, 128)
    assert twin_drawable(folder, 128) is not twin_drawable(folder, 256)
    assert raycast_shape(folder) is raycast_shape(folder)
    assert simplified_twin_drawable(folder, 0.001) is simplified_twin_drawable(folder, 0.001)


def test_twin_that_was_built_again_is_read_again(folder: Path) -> None:
    looks, shape, simplified = (
        twin_drawable(folder, 128),
        raycast_shape(folder),
        simplified_twin_drawable(folder, 0.001),
    )
    record = json.loads((folder / RECORD).read_text())
    (folder / RECORD).write_text(json.dumps(record, indent=4) + "\n")
    assert twin_drawable(folder, 128) is not looks
    assert simplified_twin_drawable(folder, 0.001) is not simplified
    again = raycast_shape(folder)
    assert again is not shape
    assert np.array_equal(again.vertices_m, shape.vertices_m)


def test_a_surface_that_was_cut_short_is_to_be_built_again(folder: Path) -> None:
    visual = folder / "visual.glb"
    visual.write_bytes(visual.read_bytes()[:-40])
    for look in (lambda: twin_drawable(folder, 131), lambda: simplified_twin_drawable(folder, 0.0013)):
        with pytest.raises(TwinError, match=r"cannot be read .*build the twin again"):
            look()


def test_missing_twin_is_said(tmp_path: Path) -> None:
    with pytest.raises(TwinError):
        twin_drawable(tmp_path / "none", 128)
    with pytest.raises(TwinError):
        raycast_shape(tmp_path / "none")
