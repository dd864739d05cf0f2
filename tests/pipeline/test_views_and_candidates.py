"""Views and candidate points of a cup whose geometry is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.config import CandidatesConfig, ViewsConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.formats.glb import write_glb
from manitwin.geometry.distance import distance_to_surface
from manitwin.pipeline.candidates import CandidatesStage
from manitwin.pipeline.item import Item
from manitwin.pipeline.views import ViewsStage
from manitwin.render.background_colors import marker_color
from manitwin.render.cameras import Camera, project
from manitwin.render.surfaces import plain_part

SCALE = 0.5


def cup() -> trimesh.Trimesh:
    profile = [[0, 0], [0.08, 0], [0.08, 0.2], [0.07, 0.2], [0.07, 0.01], [0, 0.01]]
    return trimesh.creation.revolve(np.array(profile), sections=64)


def draft_of(folder: Path) -> Draft:
    """A cup of 0.2 m in the canonical mesh that ``physical`` made half as large."""
    mesh = cup()
    (folder / "canonical.glb").write_bytes(write_glb([plain_part(mesh, (150, 60, 40))]))
    mesh.apply_scale(SCALE)
    (folder / "visual.glb").write_bytes(write_glb([plain_part(mesh, (150, 60, 40))]))
    np.savez(folder / "solid.npz", vertices=mesh.vertices, faces=mesh.faces)
    names = ("canonical.glb", "visual.glb", "solid.npz", "views/")
    return Draft("cup", Item(None), 7, {"physical": {"scale_applied": SCALE}}, {n: folder / n for n in names})


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Draft]:
    folder = tmp_path_factory.mktemp("cup")
    draft = draft_of(folder)
    draft.fields |= ViewsStage(ViewsConfig(), 256).run(draft, folder)
    draft.fields |= CandidatesStage(CandidatesConfig()).run(draft, folder)
    return folder, draft


def test_eight_views_show_the_whole_cup(made: tuple[Path, Draft]) -> None:
    folder, draft = made
    assert len(draft.field("cameras")) == 8
    for index in range(8):
        view = np.asarray(Image.open(folder / "views" / f"rgb_{index:02d}.webp").convert("RGB")).astype(int)
        height, width = view.shape[:2]
        assert height * width == pytest.approx(256**2, rel=0.02)
        y, x = np.nonzero(view[..., 0] - view[..., 2] > 40)  # the cup is red-brown
        assert len(x) > 0.2 * 256 * 256
        assert 0 < x.min() <= x.max() < width - 1 and np.ptp(x) > 0.6 * width
        assert 0 < y.min() <= y.max() < height - 1 and np.ptp(y) > 0.6 * height


def test_candidates_lie_on_the_true_size_surface_and_apart(made: tuple[Path, Draft]) -> None:
    _, draft = made
    positions = np.array(draft.field("candidates")["positions_m"])
    normals = np.array(draft.field("candidates")["normals"])
    mesh = cup().apply_scale(SCALE)
    assert positions.shape == normals.shape == (42, 3)
    assert distance_to_surface(positions, mesh).max() < 1e-6
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(42))
    apart = np.linalg.norm(positions[:, None] - positions[None], axis=2) + np.eye(42)
    same_side = normals @ normals.T > 0  # the middles of a floor above and below are as near as it is thick
    assert apart[same_side].min() > 0.35 * np.sqrt(mesh.area / 42)


def test_candidates_are_at_the_rim_and_few_on_the_underside(made: tuple[Path, Draft]) -> None:
    _, draft = made
    positions = np.array(draft.field("candidates")["positions_m"])
    normals = np.array(draft.field("candidates")["normals"])
    underside = (positions[:, 2] < 0.001) & (normals[:, 2] < -0.8)
    assert 1 <= underside.sum() <= 0.2 * 42
    assert (positions[:, 2] > 0.095).sum() >= 4
    assert np.linalg.norm(positions[underside], axis=1).min() < 0.008  # its middle


def test_every_candidate_is_marked_on_some_view_and_only_where_seen(made: tuple[Path, Draft]) -> None:
    folder, draft = made
    positions = np.array(draft.field("candidates")["positions_m"])
    visible = draft.field("visible_candidates")
    assert sorted({i for ids in visible for i in ids}) == list(range(42))
    outside = np.linalg.norm(positions[:, :2], axis=1) > 0.0399
    views = [np.asarray(Image.open(folder / "views" / f"rgb_{i:02d}.webp").convert("RGB")) for i in range(8)]
    color = marker_color(views)
    assert color.name != "red", "the cup is red-brown"
    for index, ids in enumerate(visible):
        camera = Camera.from_json(draft.field("cameras")[index]).scaled(SCALE)
        marked = np.asarray(Image.open(folder / "marked" / f"marked_{index:02d}.webp").convert("RGB")).astype(int)
        pixels, _ = project(positions, camera)
        for i in np.flatnonzero(outside):
            # The outer wall is a cylinder: a point on it is seen where its radius turns to the camera.
            toward = camera.position[:2] - positions[i, :2]
            facing = float(toward @ positions[i, :2]) / (np.linalg.norm(toward) * 0.04)
            if abs(facing) > 0.15 and 0.005 < positions[i, 2] < 0.095:
                assert (i in ids) == (facing > 0)
        dots = [np.abs(marked[int(y), int(x)] - color.rgb).max() < 90 for x, y in pixels[ids]]
        assert np.mean(dots) > 0.8  # numbers may lie over a dot where it is crowded; WebP shifts colours


def test_same_seed_same_bytes(made: tuple[Path, Draft], tmp_path: Path) -> None:
    folder, draft = made
    again = CandidatesStage(CandidatesConfig()).run(draft, tmp_path)
    assert again["candidates"] == draft.field("candidates")
    for index in range(8):
        name = f"marked/marked_{index:02d}.webp"
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_solid_that_left_its_surface_is_rejected(made: tuple[Path, Draft], tmp_path: Path) -> None:
    _, draft = made
    mesh = cup().apply_scale(SCALE)
    np.savez(tmp_path / "solid.npz", vertices=mesh.vertices * 0.8 + np.array([0, 0, 0.012]), faces=mesh.faces)
    other = Draft("cup", draft.payload, 7, draft.fields, {**draft.paths, "solid.npz": tmp_path / "solid.npz"})
    with pytest.raises(Rejected, match="degenerate"):
        CandidatesStage(CandidatesConfig()).run(other, tmp_path)
