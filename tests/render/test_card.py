"""The card, and what is drawn on it."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.geometry.poses import transform
from manitwin.render.cameras import framing_camera, project
from manitwin.render.card import HEIGHT, PANEL, RED, WIDTH, CardText, make_card, mesh_caption
from manitwin.render.card_panels import GRASP, CardGrasp, CardPoint, input_panel, select_diverse_grasps
from manitwin.render.center_of_mass import CenterOfMass, draw_center_of_mass
from manitwin.render.renderer import BACKDROP
from manitwin.render.surfaces import plain_part
from manitwin.robots.grippers.gripper import load_gripper

TEXT = CardText("box", "a plain box", [("size", "60 x 40 x 100 mm"), ("mass", "0.2 kg")], "source box.obj")


def box() -> trimesh.Trimesh:
    return trimesh.creation.box([0.06, 0.04, 0.1]).apply_translation([0, 0, 0.05])


def card(**changes: object) -> bytes:
    gripper = load_gripper("panda")
    down = np.diag([1.0, -1.0, -1.0])
    grasps = [
        CardGrasp(transform(down, np.array([x, 0.0, 0.16])), gripper.boxes(0.06))
        for x in np.linspace(-0.005, 0.005, 20)
    ]
    points = [CardPoint(np.array([0.0, -0.02, 0.05]), np.array([0.0, -1.0, 0.0]), "side", False)]
    arguments: dict[str, object] = {
        "parts": [plain_part(box(), (180, 120, 60))],
        "solid": box(),
        "hulls": [np.asarray(box().vertices)],
        "points": points,
        "grasps": grasps,
        "text": TEXT,
    }
    return make_card(**(arguments | changes))  # type: ignore[arg-type]


def test_card_is_the_same_png_each_time_and_shows_its_point() -> None:
    first = card()
    assert card() == first
    image = np.asarray(Image.open(io.BytesIO(first)))
    assert image.shape == (HEIGHT, WIDTH, 3)
    last_column = image[:, WIDTH - 24 - PANEL : WIDTH - 24]
    assert (last_column == GRASP).all(2).sum() > 50


def test_card_shows_the_photo_or_the_prompt_in_the_first_column() -> None:
    photo = np.zeros((300, 200, 3), dtype=np.uint8)
    photo[..., 2] = 255
    with_photo = np.asarray(Image.open(io.BytesIO(card(photo=photo))))[:, 24 : 24 + PANEL]
    with_prompt = np.asarray(Image.open(io.BytesIO(card(prompt="a plain box"))))[:, 24 : 24 + PANEL]
    assert (with_photo == (0, 0, 255)).all(2).sum() > 0.6 * PANEL * PANEL
    assert not (with_prompt == (0, 0, 255)).all(2).any()


def test_what_was_made_of_words_and_stands_is_seen_from_its_front_though_more_is_seen_from_behind() -> None:
    def leaning(side: float) -> trimesh.Trimesh:
        board = trimesh.creation.box([0.08, 0.006, 0.06]).apply_translation([0, 0, 0.03])
        return board.apply_transform([[1, 0, 0, 0], [0, 1, side * 0.9, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    def rendered(side: float, **source: object) -> np.ndarray:
        solid = leaning(side)
        drawn = card(
            parts=[plain_part(solid, (180, 120, 60))], solid=solid, hulls=[np.asarray(solid.vertices)], **source
        )
        left = 24 + PANEL + (WIDTH - 48 - 4 * PANEL) // 3
        return np.asarray(Image.open(io.BytesIO(drawn)), dtype=np.int64)[:, left : left + PANEL]

    photo = np.zeros((300, 200, 3), dtype=np.uint8)
    towards, away = -1.0, 1.0
    assert (rendered(towards, prompt="a board") == rendered(towards, photo=photo)).mean() > 0.95, (
        "as a photo's thing is"
    )
    assert (rendered(away, prompt="a board") == rendered(away)).mean() > 0.95, (
        "of a mesh the side of which more is seen"
    )
    assert (rendered(towards, prompt="a board") == rendered(towards)).mean() < 0.95


def test_photo_keeps_its_shape_and_its_matte() -> None:
    photo = np.zeros((1000, 500, 4), dtype=np.uint8)
    photo[300:500, 200:300] = (255, 0, 0, 255)
    panel = input_panel(photo, 248)
    red = (panel == (255, 0, 0)).all(2)
    assert red[26:222, 76:172].all() and not (
        red[:22].any() or red[226:].any() or red[:, :72].any() or red[:, 176:].any()
    )
    assert (panel[5, 100] == BACKDROP).all() and (panel[100, 20] == BACKDROP).all()


def test_what_is_cut_out_at_the_edge_has_the_margin_that_there_is() -> None:
    photo = np.zeros((100, 100, 4), dtype=np.uint8)
    photo[:, :50] = (255, 0, 0, 255)
    panel = input_panel(photo, 200)
    assert (panel[100, 90] == (255, 0, 0)).all() and (panel[100, 185] == BACKDROP).all()


def test_diverse_grasps_come_from_all_clusters() -> None:
    rng = np.random.default_rng(0)
    poses = np.tile(np.eye(4), (90, 1, 1))
    poses[:, :3, 3] = rng.normal(0, 0.002, (90, 3)) + np.repeat(np.eye(3) * 0.2, 30, axis=0)
    chosen = select_diverse_grasps(poses, 3)
    assert sorted(chosen // 30) == [0, 1, 2]


def test_a_stamp_is_seen_on_every_picture_of_what_was_made() -> None:
    plain, stamped = (
        np.asarray(Image.open(io.BytesIO(card(text=replace(TEXT, stamp=word))))) for word in (None, "REHEARSAL")
    )
    for column in range(1, 4):
        left = 24 + column * (PANEL + 16)
        red = [(image[96 : 96 + PANEL, left : left + PANEL] == RED).all(2).sum() for image in (plain, stamped)]
        assert red[0] == 0 and red[1] > 500


def test_centre_of_mass_is_drawn_where_it_is_with_a_ring_as_wide_as_it_is_uncertain() -> None:
    camera = framing_camera(
        box().vertices, azimuth_deg=0.0, elevation_deg=0.0, fov_y_deg=24.0, width_px=200, height_px=200
    )
    grey = np.full((200, 200, 3), 128, dtype=np.uint8)
    center = np.array([0.0, 0.01, 0.03])
    drawn = draw_center_of_mass(grey, CenterOfMass(center, 0.02), camera)
    changed = np.argwhere((drawn != 128).any(2))[:, ::-1] + 0.5
    pixels, depth = project(center[None], camera)
    away = np.linalg.norm(changed - pixels[0], axis=1)
    assert changed.mean(0) == pytest.approx(pixels[0], abs=0.5)
    ring_px = camera.focal_px * 0.02 / depth[0]
    assert np.median(away[away > ring_px / 2]) == pytest.approx(ring_px, abs=1.0)
    small = draw_center_of_mass(grey, CenterOfMass(center, 0.0), camera)
    assert 40 < (small != 128).any(2).sum() < 200, "the disc alone"
    assert {(0, 0, 0), (1, 1, 1)} <= {tuple(p) for p in (small[(small != 128).any(2)] > 128).astype(int)}
    assert card(mass=CenterOfMass(center, 0.01)) != card()


def test_one_hull_is_no_hulls() -> None:
    assert mesh_caption(10_162, 1) == "10,162 triangles, 1 convex collision hull"
    assert mesh_caption(12, 2) == "12 triangles, 2 convex collision hulls"
