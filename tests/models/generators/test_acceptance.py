"""Which generated meshes are refused, and in which words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.models.fakes.meshes import (
    Surface,
    body_and_cap,
    bottle,
    draco_glb,
    glb,
    open_surface,
    truncated,
    usdz,
    webp_glb,
)
from manitwin.models.generators.acceptance import flaw


def _flaw(tmp_path: Path, data: bytes, name: str = "made.glb") -> str | None:
    (tmp_path / name).write_bytes(data)
    return flaw(tmp_path / name)


def _with(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    whole = bottle()
    return glb([Surface("x", vertices, faces, np.zeros((len(vertices), 2)), whole.texture)])


def test_whole_meshes_pass(tmp_path: Path) -> None:
    assert _flaw(tmp_path, glb([bottle()])) is None
    assert _flaw(tmp_path, webp_glb()) is None
    assert _flaw(tmp_path, glb(body_and_cap())) is None
    assert _flaw(tmp_path, glb([bottle()], up="z")) is None
    assert _flaw(tmp_path, usdz([bottle()]), "made.usdz") is None


def test_mesh_with_a_hole_and_a_bowl_without_thickness_pass(tmp_path: Path) -> None:
    whole = bottle()
    assert _flaw(tmp_path, _with(whole.vertices, whole.faces[50:])) is None
    sphere = trimesh.creation.icosphere(3)
    bowl = sphere.faces[(sphere.vertices[sphere.faces][:, :, 1] < 0.1).all(1)]
    assert _flaw(tmp_path, _with(np.asarray(sphere.vertices), bowl)) is None


def test_both_sides_of_a_surface_pass(tmp_path: Path) -> None:
    whole = bottle()
    assert _flaw(tmp_path, _with(whole.vertices, np.concatenate([whole.faces, whole.faces[:, ::-1]]))) is None


@pytest.mark.parametrize("scraps", [60, 200, 400, 1000])
def test_scraps_are_refused(tmp_path: Path, scraps: int) -> None:
    whole = bottle()
    rows = whole.faces[np.random.default_rng(scraps).choice(len(whole.faces), scraps, replace=False)].reshape(-1)
    wrong = _flaw(tmp_path, _with(whole.vertices[rows], np.arange(len(rows)).reshape(-1, 3)))
    assert wrong is not None and wrong.startswith("made.glb: ")


def test_words_of_each_refusal(tmp_path: Path) -> None:
    whole = bottle()
    assert "KHR_draco_mesh_compression" in str(_flaw(tmp_path, draco_glb()))
    assert "truncated" in str(_flaw(tmp_path, truncated(glb([whole]))))
    assert "zero bytes" in str(_flaw(tmp_path, b""))
    assert "watertight" in str(_flaw(tmp_path, glb([open_surface()])))
    assert "one point" in str(_flaw(tmp_path, _with(whole.vertices * 0, whole.faces)))
    flat = str(_flaw(tmp_path, _with(whole.vertices * [1, 1, 0], whole.faces)))
    assert "watertight" in flat or "volume" in flat
    nan = whole.vertices.copy()
    nan[100] = np.nan
    assert "NaN" in str(_flaw(tmp_path, _with(nan, whole.faces)))
