"""What the photo does not show of a lifted thing: no letters of the front there, mirrored or not, and the front's colours."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh

from manitwin.config import GenerateConfig
from manitwin.engine.job_memory import NullJobMemory
from manitwin.formats.glb import read_glb, write_glb
from manitwin.models.generators.lift import LiftGenerator
from manitwin.models.generators.lift.lifting import LiftedObject, ShapeHint, lift
from manitwin.models.generators.lift.photo_generation import textured_part
from manitwin.models.generators.lift.surface import unseen_share
from manitwin.models.generators.protocol import GenerationRequest
from manitwin.models.generators.run import run_generator
from manitwin.render.cameras import framing_camera
from manitwin.render.renderer import shared_renderer

SIDE_PX = 256
DETAIL_SIGMA_PX = 4.0
EDGE_PX = 4
LABEL, INK, CAP = (228, 220, 200), (40, 60, 150), (190, 40, 40)

SHAPES = {
    "box": ([(150, 80), (450, 80), (450, 520), (150, 520)], ShapeHint()),
    "revolution": ([(170, 80), (430, 80), (430, 520), (170, 520)], ShapeHint(round=True)),
    "inflation": (
        [(120, 130), (300, 80), (480, 150), (440, 330), (480, 520), (180, 520), (150, 300)],
        ShapeHint(stands=True),
    ),
}


def _lettered(outline: list[tuple[int, int]], *, cap: bool = False) -> np.ndarray:
    """An RGBA picture of a thing with five lines of letters, none of which is its own mirror image."""
    rgba = np.zeros((600, 600, 4), np.uint8)
    mask = np.zeros((600, 600), np.uint8)
    cv2.fillPoly(mask, [np.array(outline, np.int32)], 1)
    rgba[mask > 0] = (*LABEL, 255)
    if cap:
        rgba[:180][mask[:180] > 0] = (*CAP, 255)
    for row, word in enumerate(("FRESH", "RJG 5", "LEK 2", "PZFE", "SRG 7")):
        cv2.putText(rgba, word, (195, 225 + 62 * row), cv2.FONT_HERSHEY_SIMPLEX, 1.9, (*INK, 255), 7)
    return rgba


@pytest.mark.parametrize("kind", ["revolution", "inflation"])
def test_what_the_photo_sees_askew_takes_none_of_its_pixels(kind: str) -> None:
    surface = lift(_lettered(SHAPES[kind][0]), SHAPES[kind][1]).surface
    normals = trimesh.Trimesh(surface.vertices, surface.faces, process=False).face_normals
    seen = surface.visible_faces()
    beside = seen & (np.abs(normals[:, 1]) < 0.9)  # no end on which it stands
    assert normals[beside, 2].min() > 0.2, "its pixels would be streaks"
    assert seen[normals[:, 2] > 0.5].mean() > 0.98


def _views(lifted: LiftedObject, folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the front, the back as the front's camera would see it through the thing, and where both show it."""
    path = folder / "lifted.glb"
    path.write_bytes(write_glb([textured_part(lifted)]))
    parts = read_glb(path)
    points = np.concatenate([part.vertices for part in parts])
    cameras = [
        framing_camera(points, azimuth_deg=azimuth, elevation_deg=0, fov_y_deg=12, width_px=SIDE_PX, height_px=SIDE_PX)
        for azimuth in (-90.0, 90.0)
    ]
    front, back = shared_renderer().render(parts, cameras, background=(255, 255, 255))
    both = (front.coverage > 0.99) & (back.coverage[:, ::-1] > 0.99)
    return (
        front.rgb.astype(float),
        back.rgb[:, ::-1].astype(float),
        cv2.erode(both.astype(np.uint8), np.ones((2 * EDGE_PX + 1,) * 2)) > 0,
    )


def _detail(picture: np.ndarray) -> np.ndarray:
    grey = picture.mean(axis=2)
    return np.asarray(grey - cv2.GaussianBlur(grey, (0, 0), DETAIL_SIGMA_PX))


@pytest.mark.parametrize("primitive", SHAPES)
def test_letters_of_the_front_are_not_on_the_back(primitive: str, tmp_path: Path) -> None:
    outline, hint = SHAPES[primitive]
    lifted = lift(_lettered(outline), hint)
    assert lifted.notes["primitive"] == primitive and lifted.notes["rests"] == "standing"
    front, back, both = _views(lifted, tmp_path)
    assert both.sum() > 8000
    written, unwritten = _detail(front)[both], _detail(back)[both]
    assert written.std() > 8, "the front shows its letters"
    assert unwritten.std() < 0.2 * written.std()
    # where a mirrored letter was, the back is as light as beside it
    ink, paper = front.mean(axis=2)[both] < 110, front.mean(axis=2)[both] > 150
    assert ink.sum() > 500
    grey = back.mean(axis=2)[both]
    assert abs(grey[ink].mean() - grey[paper].mean()) < 4
    assert abs(np.corrcoef(written, unwritten)[0, 1]) < 0.2


@pytest.mark.parametrize("primitive", SHAPES)
def test_back_has_the_colours_of_the_front_by_their_place(primitive: str, tmp_path: Path) -> None:
    outline, hint = SHAPES[primitive]
    front, back, both = _views(lift(_lettered(outline, cap=True), hint), tmp_path)
    rows = np.nonzero(both.any(axis=1))[0]
    low = rows[len(rows) // 3 :]
    for part, expected in ((rows[: len(rows) // 8], CAP), (low, LABEL)):
        there = np.zeros_like(both)
        there[part] = both[part]
        shown, painted = np.median(front[there], axis=0), np.median(back[there], axis=0)
        assert np.abs(shown - painted).max() < 12, (shown, painted)
        assert np.argmax(painted - painted.mean()) == np.argmax(np.array(expected) - np.mean(expected))


def test_front_shows_the_photo_the_right_way_round(tmp_path: Path) -> None:
    outline, hint = SHAPES["box"]
    rgba = _lettered(outline)
    front, _, both = _views(lift(rgba, hint), tmp_path)
    width, height = (int(np.ptp(np.nonzero(both.any(axis=a))[0])) + 2 * EDGE_PX + 1 for a in (0, 1))
    # a box leaves out 2 % at each edge of its front
    photo = cv2.resize(rgba[89:511, 156:444, :3], (width, height), interpolation=cv2.INTER_AREA)
    found = {}
    for name, picture in (("photo", photo), ("mirrored", photo[:, ::-1])):
        letters = _detail(picture)[8:-8, 8:-8].astype(np.float32)
        found[name] = cv2.matchTemplate(_detail(front).astype(np.float32), letters, cv2.TM_CCOEFF_NORMED).max()
    assert found["photo"] > 0.8 and found["mirrored"] < 0.5, found


def test_no_seam_shows_where_the_photo_ends() -> None:
    lifted = lift(_lettered(SHAPES["revolution"][0]), ShapeHint(round=True))
    surface, part = lifted.surface, textured_part(lifted)
    texture = np.asarray(part.visual.material.baseColorTexture).astype(float)
    at = np.asarray(part.visual.uv) * (texture.shape[1], -texture.shape[0]) + (0, texture.shape[0])
    colours = texture[at[:, 1].astype(int), at[:, 0].astype(int)]
    count = len(part.vertices) - len(surface.vertices)  # vertices that have a place on both
    places, first, times = np.unique(
        np.asarray(part.vertices).round(9), axis=0, return_inverse=True, return_counts=True
    )
    twice = np.nonzero(times == 2)[0]
    assert len(twice) == count > 50
    pairs = np.array([np.nonzero(first.ravel() == k)[0] for k in twice])
    height = places[twice][:, 2]
    sides = (height > 0.03) & (height < 0.97)  # along the body, not on the ends' rings
    steps = np.abs(colours[pairs[sides, 0]] - colours[pairs[sides, 1]]).max(axis=1)
    assert sides.sum() > 50 and np.median(steps) < 12


def test_inside_of_a_container_shows_no_letters() -> None:
    cup = lift(
        _lettered([(150, 80), (450, 80), (430, 520), (170, 520)]), ShapeHint(round=True, container=True, stands=True)
    )
    assert cup.notes["hollow"]
    surface = cup.surface
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    axis_distance = np.linalg.norm(mesh.triangles_center[:, [0, 2]], axis=1)
    inward = (
        np.einsum("ij,ij->i", mesh.face_normals[:, [0, 2]], mesh.triangles_center[:, [0, 2]]) < -0.5 * axis_distance
    )
    assert inward.sum() > 500 and not surface.visible_faces()[inward].any()


def test_same_photo_gives_the_same_bytes_and_one_closed_solid(tmp_path: Path) -> None:
    rgba = _lettered(SHAPES["inflation"][0])
    first, second = (write_glb([textured_part(lift(rgba, ShapeHint(stands=True)))]) for _ in range(2))
    assert first == second
    (tmp_path / "a.glb").write_bytes(first)
    (part,) = read_glb(tmp_path / "a.glb")
    merged = trimesh.Trimesh(part.vertices, part.faces, process=True, merge_tex=True, merge_norm=True)
    assert merged.is_watertight and merged.volume > 0


def test_generator_says_how_much_the_photo_did_not_show(tmp_path: Path) -> None:
    request = GenerationRequest(_lettered(SHAPES["revolution"][0]), None, "can", seed=0)
    made = run_generator(LiftGenerator(), request, tmp_path, settings=GenerateConfig(), jobs=NullJobMemory())
    assert made.unseen_share is not None and 0.55 < made.unseen_share < 0.75  # half of the side, and both ends
    lifted = lift(_lettered(SHAPES["box"][0]), ShapeHint())
    width, height, depth = np.ptp(lifted.surface.vertices, axis=0)
    whole = 2 * (width * height + (width + height) * depth)
    assert unseen_share(lifted.surface) == pytest.approx(1 - width * height / whole, rel=0.02)
