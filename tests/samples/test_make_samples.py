"""The committed samples are what the kept script makes, and what it says."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import manifold3d
import numpy as np
import pytest
from PIL import Image

from manitwin.formats.glb import read_glb

SAMPLES = Path(__file__).resolve().parents[2] / "samples"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_samples", SAMPLES / "make_samples.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_samples_are_small() -> None:
    assert all((SAMPLES / name).stat().st_size < 300_000 for name in ("bottle.jpg", "mug.glb"))


def test_script_makes_the_committed_photo(script: ModuleType) -> None:
    made = script.render_bottle().astype(int)
    kept = np.asarray(Image.open(SAMPLES / "bottle.jpg")).astype(int)
    assert made.shape == kept.shape and np.abs(made - kept).mean() < 2


def test_script_makes_the_committed_mug(script: ModuleType) -> None:
    made = script.mug_mesh()
    (kept,) = read_glb(SAMPLES / "mug.glb")
    assert len(kept.faces) == len(made.faces)
    assert kept.extents == pytest.approx(made.extents, abs=1e-6)
    assert kept.volume == pytest.approx(made.volume, rel=1e-4)


def test_mug_has_two_walls_and_a_handle() -> None:
    (mug,) = read_glb(SAMPLES / "mug.glb")
    solid = manifold3d.Manifold(manifold3d.Mesh(mug.vertices.astype(np.float32), mug.faces.astype(np.uint32)))
    assert mug.is_watertight and solid.genus() == 1 and len(solid.decompose()) == 1
    assert mug.bounds[0][2] == pytest.approx(0, abs=1e-6) and mug.extents[2] == pytest.approx(0.095, abs=1e-5)
    filled = np.pi * 0.041**2 * 0.095
    assert 0.15 * filled < mug.volume < 0.35 * filled
    assert mug.visual.material.baseColorTexture is not None
