"""Solids carved out of outlines of known solids, and what does not go together."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image
from typer.testing import CliRunner

from kept_opinions import kept_opinions
from manitwin.cli.arguments import parse_azimuths_deg
from manitwin.cli.main import app
from manitwin.errors import Rejected, UsageError
from manitwin.formats.glb import read_glb
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.lift import posed_carving
from manitwin.models.generators.lift.carving import BOXY_POWER, ROUND_POWER, CarvedSolid, carve
from manitwin.models.generators.lift.multi_view_generation import generate_from_views
from manitwin.models.generators.lift.surface import to_manifold
from manitwin.models.generators.protocol import PhotoView
from manitwin.pipeline.carved_photos import carve_photos
from manitwin.render.cameras import framing_camera
from manitwin.render.raycast import cast_camera
from posed_things import PLACES, pose_at, write_posed

COLORS = np.array(
    [[200, 40, 40], [40, 160, 60], [50, 70, 200], [220, 190, 60], [150, 150, 150], [90, 60, 30]], np.uint8
)
CYLINDER = trimesh.creation.cylinder(0.03, 0.12, sections=96)
BOX = trimesh.creation.box((0.1, 0.05, 0.12))


@pytest.fixture(scope="module", autouse=True)
def rules_and_the_built_in_network_asked_once() -> Iterator[None]:
    """Keep what they say of a picture: the same photos are carved with and without a name, and with others."""
    with kept_opinions():
        yield


def _photo(mesh: trimesh.Trimesh, turn_deg: float, *, size_px: int = 300) -> np.ndarray:
    """An RGBA picture from the front turned by ``turn_deg``, each direction of the surface in its own colour."""
    points = np.asarray(mesh.vertices)
    camera = framing_camera(
        points, azimuth_deg=-90 + turn_deg, elevation_deg=0, fov_y_deg=3, width_px=size_px, height_px=size_px
    )
    _, normals, face = cast_camera(RayCaster(mesh), camera)
    axes = np.concatenate([normals, -normals], axis=2)
    return np.dstack([COLORS[axes.argmax(axis=2)], np.where(face >= 0, 255, 0).astype(np.uint8)])


def _on_ground(rgba: np.ndarray) -> np.ndarray:
    """A cut-out as a photo in focus on a pale, plain ground."""
    share = rgba[..., 3:] / 255
    return cv2.GaussianBlur(
        (rgba[..., :3] * share + np.array([226, 224, 220]) * (1 - share)).astype(np.uint8), (3, 3), 0
    )


def _carved(mesh: trimesh.Trimesh, turns: list[float], power: float) -> CarvedSolid:
    photos = [(f"{turn:.0f}.png", _photo(mesh, turn, size_px=200 + int(turn))) for turn in turns]
    return carve(photos, turns, power=power)


def test_two_photos_of_a_round_thing_make_it_round() -> None:
    carved = _carved(CYLINDER, [0, 90], ROUND_POWER)
    assert to_manifold(carved.surface).volume() == pytest.approx(np.pi * 0.25**2, rel=0.06)
    assert len(to_manifold(carved.surface).decompose()) == 1 and min(carved.covered_shares) > 0.97
    assert np.ptp(carved.surface.vertices, axis=0) == pytest.approx([0.5, 1.0, 0.5], abs=0.03)


def test_two_photos_of_a_box_make_it_a_box() -> None:
    carved = _carved(BOX, [0, 90], BOXY_POWER)
    assert np.ptp(carved.surface.vertices, axis=0) == pytest.approx([10 / 12, 1.0, 5 / 12], abs=0.03)
    assert to_manifold(carved.surface).volume() == pytest.approx(50 / 144, rel=0.08)


def test_turns_are_counter_clockwise_seen_from_above() -> None:
    spout = trimesh.creation.box((0.05, 0.02, 0.02)).apply_translation((0.04, 0, 0))
    spout.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 6, [0, 0, 1]))  # towards the first viewer
    thing = trimesh.util.concatenate([CYLINDER, spout])
    photos = [(f"{turn}.png", _photo(thing, turn)) for turn in (0, 45, 90)]
    for turns, side in (((0, 45, 90), 1), ((0, -45, -90), -1)):  # the wrong way round it is the mirror image
        vertices = carve(photos, turns).surface.vertices
        tip = vertices[vertices[:, 0] > np.quantile(vertices[:, 0], 0.99)]
        assert side * (tip[:, 2].mean() - np.median(vertices[:, 2])) > 0.1


def test_a_photo_of_another_thing_is_named() -> None:
    photos = [(f"{turn:.0f}.png", _photo(CYLINDER, turn)) for turn in (0.0, 60.0, 90.0, 120.0)]
    photos[1] = ("other.png", _photo(trimesh.creation.icosphere(3, 0.06), 60))
    with pytest.raises(Rejected, match=r"other\.png: its outline does not match"):
        carve(photos, [0, 60, 90, 120])


def test_turns_that_say_too_little_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="one from the side"):
        carve_photos([tmp_path / "a.png", tmp_path / "b.png"], [0, 180])
    with pytest.raises(UsageError, match="one turn for each"):
        carve_photos([tmp_path / "a.png", tmp_path / "b.png"], [0])


def test_a_photo_is_given_once_and_a_copy_is_told(tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        Image.fromarray(_photo(BOX, 0)).save(tmp_path / name)
    with pytest.raises(UsageError, match=r"^a\.png is given twice"):
        carve_photos([tmp_path / "a.png", tmp_path / "a.png"], [0, 90])
    findings = carve_photos([tmp_path / "a.png", tmp_path / "b.png"], [0, 90], "box").findings
    assert findings == ["b.png: the same picture as a.png"]


def test_a_photo_that_cannot_be_cut_out_is_left_out_as_in_a_build(tmp_path: Path) -> None:
    paths = []
    for folder, turn in (("left", 0), ("right", 90), ("top", 45)):
        (tmp_path / folder).mkdir()
        paths.append(tmp_path / folder / "photo.png")
        Image.fromarray(_photo(BOX, turn)).save(paths[-1])
    whole = carve_photos(paths, [0, 90, 45], "box")
    assert [outline.name for outline in whole.carved.photos] == ["left/photo.png", "right/photo.png", "top/photo.png"]
    Image.new("RGB", (96, 96), (120, 130, 140)).save(paths[2])
    made = carve_photos(paths, [0, 90, 45], "box")
    assert [outline.name for outline in made.carved.photos] == ["left/photo.png", "right/photo.png"]
    assert made.findings[0].startswith("left out: top/photo.png: ")
    Image.new("RGB", (96, 96), (120, 130, 150)).save(paths[1])
    with pytest.raises(
        Rejected, match=r"only left/photo\.png of 3 photos could be cut out; left out: right/photo\.png: "
    ):
        carve_photos(paths, [0, 90, 45], "box")


def test_poses_stand_for_turns_and_give_the_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(posed_carving, "CELLS", 100)  # as fine as its size is asked for
    paths = write_posed(tmp_path, [pose_at(*place) for place in PLACES[:5]], units="m")
    made = carve_photos(paths, None, poses=tmp_path / "transforms.json")
    assert made.metric and np.ptp(made.part.vertices[:, 2]) == pytest.approx(0.104, abs=0.004)
    assert any("their unit is m, as transforms.json states" in finding for finding in made.findings)
    with pytest.raises(UsageError, match="but not both"):
        carve_photos(paths, [0, 1, 2, 3, 4], poses=tmp_path / "transforms.json")
    with pytest.raises(UsageError, match=r"--poses: nothing\.json: not found"):
        carve_photos(paths, None, poses=tmp_path / "nothing.json")


@pytest.mark.slow
def test_alpha_channels_count_as_in_a_build(tmp_path: Path) -> None:
    """A faint cut-out is the thing, a second thing beside it is none, and bars around a picture cut nothing out."""
    plain = [_photo(BOX, turn) for turn in (0, 90)]
    faint = [np.dstack([photo[..., :3], photo[..., 3] // 2]) for photo in plain]
    grounds = [np.pad(_on_ground(photo), ((80, 80), (80, 80), (0, 0)), mode="edge") for photo in plain]
    grounds = [np.dstack([photo, np.full(photo.shape[:2], 200, np.uint8)]) for photo in grounds]
    even = [plain[0], grounds[1]]
    barred = [np.pad(photo | np.uint8([0, 0, 0, 255]), ((40, 40), (0, 0), (0, 0))) for photo in grounds]
    two = [photo.copy() for photo in plain]
    two[1][5:85, 5:80, 3] = 255

    def carved(pictures: list[np.ndarray], name: str | None) -> tuple[CarvedSolid, str]:
        for number, picture in enumerate(pictures):
            Image.fromarray(picture).save(tmp_path / f"{number}.png")
        made = carve_photos([tmp_path / "0.png", tmp_path / "1.png"], [0, 90], name)
        return made.carved, "; ".join(made.findings)

    for pictures, name, said in (
        (plain, "box", ""),
        (faint, "box", "1.png: its alpha channel reaches 127 of 255"),
        (barred, "mug", "1.png: its alpha channel frames an upright rectangle"),
        (even, "box", "1.png: its alpha channel is 200 of 255 everywhere: not used"),
    ):
        solid, findings = carved(pictures, name)
        assert said in findings
        assert np.ptp(solid.surface.vertices, axis=0) == pytest.approx([10 / 12, 1.0, 5 / 12], abs=0.05)
    with pytest.raises(Rejected, match=r"0\.png: its alpha channel is an upright rectangle"):
        carved(barred, None)
    with pytest.raises(Rejected, match=r"1\.png: 2 separate objects"):
        carved(two, "box")


def test_the_command_writes_a_mesh_with_each_side_from_its_photo(tmp_path: Path) -> None:
    paths = []
    for turn in (0, 90, 180):
        paths.append(tmp_path / f"{turn}.png")
        Image.fromarray(_photo(BOX, turn)).save(paths[-1])
    out = tmp_path / "box.glb"
    done = CliRunner().invoke(app, ["carve", *map(str, paths), "--turns", "0,90,180", "--name", "box", "-o", str(out)])
    assert done.exit_code == 0, done.output
    (part,) = read_glb(out)
    texture = np.asarray(part.visual.material.baseColorTexture.convert("RGB"))
    for normal, color in (((0, -1, 0), COLORS[4]), ((1, 0, 0), COLORS[0]), ((0, 1, 0), COLORS[1])):
        faces = part.face_normals @ np.array(normal) > 0.95
        uv = np.asarray(part.visual.uv)[part.faces[faces]].mean(axis=1)
        at = np.clip(uv * texture.shape[1::-1], 0, np.array(texture.shape[1::-1]) - 1)
        seen = texture[(texture.shape[0] - 1 - at[:, 1]).astype(int), at[:, 0].astype(int)]
        assert faces.sum() > 20 and np.abs(np.median(seen, axis=0) - color).max() < 12


def _views(mesh: trimesh.Trimesh, turns: tuple[float, ...], *, stated: bool) -> list[PhotoView]:
    return [PhotoView(f"{turn:.0f}.png", _photo(mesh, turn), turn if stated else None) for turn in turns]


def test_views_of_a_nameless_thing_are_carved_at_their_stated_turns() -> None:
    made = generate_from_views(_views(BOX, (0.0, 90.0, 180.0), stated=True), None)
    assert made.notes["primitive"] == "visual hull" and made.notes["confidence"] > 0.95
    assert np.ptp(made.part.vertices, axis=0) == pytest.approx([10 / 12, 5 / 12, 1.0], abs=0.03)
    assert made.unseen_share < 0.6


@pytest.mark.slow
def test_outlines_alone_do_not_tell_turns_but_a_round_thing_needs_none() -> None:
    for mesh, name in ((BOX, None), (CYLINDER, None), (BOX, "orange")):
        with pytest.raises(Rejected, match=r"0\.png, 90\.png: .*give the camera's turns with --turns"):
            generate_from_views(_views(mesh, (0.0, 90.0), stated=False), name)
    made = generate_from_views(_views(CYLINDER, (0.0, 90.0), stated=False), "orange")
    assert made.notes["primitive"] == "revolution"
    assert made.part.volume == pytest.approx(np.pi * 0.25**2, rel=0.06)


def test_views_from_one_direction_and_its_opposite_are_refused() -> None:
    with pytest.raises(Rejected, match="from the side"):
        generate_from_views(_views(BOX, (0.0, 180.0), stated=True), None)


def test_the_command_says_what_it_needs(tmp_path: Path) -> None:
    photo = tmp_path / "a.png"
    Image.fromarray(_photo(BOX, 0)).save(photo)
    for words, told in (
        (["--turns", "0,x", "-o", str(tmp_path / "a.glb")], "list of degrees"),
        (["--turns", "0,90", "-o", str(tmp_path / "a.obj")], "GLB"),
        (["--turns", "0,90", "-o", str(tmp_path / "none" / "a.glb")], "this folder does not exist"),
    ):
        done = CliRunner().invoke(app, ["carve", str(photo), str(photo), *words])
        assert done.exit_code != 0 and told in " ".join(done.output.split()) + str(done.exception)


def test_turns_go_on_by_equal_steps_where_dots_say_so() -> None:
    assert parse_azimuths_deg("0,90,180", 3) == [0, 90, 180]
    assert parse_azimuths_deg("0,-10, ...", 4) == [0, -10, -20, -30]
    assert parse_azimuths_deg("0,30,75,...", 3) == [0, 30, 75]
    for value, photos, told in (
        ("0,...", 3, "give two or more angles"),
        ("...", 3, "not a list of degrees"),
        ("0,1,2,...", 2, "2 photos"),
    ):
        with pytest.raises(UsageError, match=told):
            parse_azimuths_deg(value, photos)
