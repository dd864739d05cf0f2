"""Solids lifted from drawn silhouettes, against their closed forms; and real photos."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.errors import Rejected, Unsupported
from manitwin.formats.glb import read_glb
from manitwin.formats.image_file import read_image
from manitwin.models.generators.lift import LiftGenerator
from manitwin.models.generators.lift.hint import hint_from_name, roundness_conflict
from manitwin.models.generators.lift.inflation import inflate
from manitwin.models.generators.lift.lifting import LiftedObject, ShapeHint, lift
from manitwin.models.generators.lift.photo_generation import fit_or_lift, generate_from_photo
from manitwin.models.generators.lift.surface import tip_angle_deg, to_manifold
from manitwin.models.generators.protocol import GenerationRequest
from manitwin.models.matting import matte_photo

NO_HINT = ShapeHint()


def _drawn(
    *polygons: list[tuple[float, float]], size: int = 600, colour: tuple[int, int, int] = (60, 120, 200)
) -> np.ndarray:
    """An RGBA picture of filled polygons on transparent magenta."""
    rgba = np.zeros((size, size, 4), np.uint8)
    rgba[...] = (255, 0, 255, 0)
    for polygon in polygons:
        mask = np.zeros((size, size), np.uint8)
        cv2.fillPoly(mask, [np.round(polygon).astype(np.int32)], 1)
        rgba[mask > 0] = (*colour, 255)
    return rgba


def _turned(points: list[tuple[float, float]], degrees: float) -> list[tuple[float, float]]:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [(300 + c * (x - 300) - s * (y - 300), 300 + s * (x - 300) + c * (y - 300)) for x, y in points]


def _check_contract(lifted: LiftedObject) -> None:
    surface = lifted.surface
    solid = to_manifold(surface)
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    assert solid.volume() > 0 and len(solid.decompose()) == 1
    assert 2000 <= len(surface.faces) <= 20000
    assert (high - low).max() == pytest.approx(1.0) and low[1] == pytest.approx(0.0, abs=1e-9)
    assert np.allclose((low + high)[[0, 2]], 0, atol=1e-9)
    assert tip_angle_deg(surface) > 5  # it stands on its flat base
    feet = surface.vertices[:, 1] < 1e-4
    assert feet.sum() >= 3
    assert not (np.abs(lifted.texture.astype(int) - [255, 0, 255]).sum(2) < 120).any()


def test_rectangle_with_round_hint_is_a_cylinder() -> None:
    lifted = lift(_drawn([(220, 100), (380, 100), (380, 500), (220, 500)]), ShapeHint(round=True))
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "revolution" and lifted.notes["rests"] == "standing"
    assert to_manifold(lifted.surface).volume() == pytest.approx(math.pi * 0.2**2, rel=0.03)


def test_rectangle_is_a_box_of_said_depth() -> None:
    lifted = lift(_drawn([(200, 100), (400, 100), (400, 500), (200, 500)]), NO_HINT)
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "box"
    assert np.ptp(lifted.surface.vertices, axis=0) == pytest.approx(
        [0.5, 1.0, 0.5 * lifted.notes["depth_share"]], abs=0.02
    )


@pytest.mark.parametrize(
    ("name", "width_m", "height_m", "depth_m"),
    [("cracker box", 0.164, 0.213, 0.072), ("rubik's cube", 0.057, 0.057, 0.057), ("wood block", 0.085, 0.2, 0.085),
     ("juice carton", 0.07, 0.235, 0.07), ("brick", 0.102, 0.215, 0.065)],
)  # fmt: skip
def test_a_box_of_known_sides_is_about_as_deep_as_it_is(
    name: str, width_m: float, height_m: float, depth_m: float
) -> None:
    x, y = 400 * width_m / height_m / 2, 200.0
    picture = _drawn([(300 - x, 300 - y), (300 + x, 300 - y), (300 + x, 300 + y), (300 - x, 300 + y)])
    lifted = lift(picture, hint_from_name(name))
    assert lifted.notes["primitive"] == "box"
    sides = np.ptp(lifted.surface.vertices, axis=0) * height_m
    assert sides == pytest.approx([width_m, height_m, depth_m], rel=0.15)


@pytest.mark.parametrize(("volume_share", "thick"), [(0.01, 0.02), (0.0001, 0.01), (None, 0.06)])
def test_a_flat_box_has_the_volume_of_its_category_but_for_a_least_thickness(
    volume_share: float | None, thick: float
) -> None:
    lifted = lift(
        _drawn([(200, 100), (400, 100), (400, 500), (200, 500)]),
        ShapeHint(boxy=True, flat=True, volume_share=volume_share),
    )
    assert lifted.notes["primitive"] == "box" and lifted.notes["rests"] == "lying"
    assert np.sort(np.ptp(lifted.surface.vertices, axis=0)) == pytest.approx([thick, 0.5, 1.0], abs=0.005)


def test_disc_is_a_sphere_with_a_flat_base() -> None:
    circle = [(300 + 200 * math.cos(a), 300 + 200 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 200)]
    lifted = lift(_drawn(circle), NO_HINT)
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "revolution"
    assert to_manifold(lifted.surface).volume() == pytest.approx(math.pi / 6, rel=0.04)


@pytest.mark.parametrize("degrees", [0, 30, 80])
def test_tilted_bottle_is_turned_round_and_set_upright(degrees: float) -> None:
    half = [(0, 90), (25, 90), (25, 180), (80, 240), (80, 510), (0, 510)]
    outline = [(300 + x, y) for x, y in half] + [(300 - x, y) for x, y in reversed(half)]
    lifted = lift(_drawn(_turned(outline, degrees)), NO_HINT)
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "revolution" and lifted.notes["rests"] == "standing"
    assert lifted.notes["axis_tilt_deg"] == pytest.approx(degrees, abs=1.5)
    vertices = lifted.surface.vertices
    assert np.ptp(vertices, axis=0) == pytest.approx([160 / 420, 1.0, 160 / 420], abs=0.03)
    assert np.abs(vertices[vertices[:, 1] > 0.9][:, 0]).max() < 0.09  # the neck is on top


def test_container_is_hollow_and_open_at_the_top() -> None:
    rgba = _drawn([(180, 150), (420, 150), (400, 450), (200, 450)])
    full = lift(rgba, ShapeHint(round=True))
    cup = lift(rgba, ShapeHint(round=True, container=True, stands=True))
    _check_contract(cup)
    assert cup.notes["hollow"] and not full.notes["hollow"]
    assert to_manifold(cup.surface).volume() < 0.3 * to_manifold(full.surface).volume()
    assert to_manifold(cup.surface).genus() == 0


def test_ring_keeps_its_hole() -> None:
    rgba = _drawn([(300 + 200 * math.cos(a), 300 + 150 * math.sin(a)) for a in np.linspace(0, 6.283, 120)])
    inner = np.zeros((600, 600), np.uint8)
    cv2.ellipse(inner, (300, 300), (150, 100), 0, 0, 360, 1, -1)
    rgba[inner > 0] = (255, 0, 255, 0)
    lifted = lift(rgba, NO_HINT)
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "inflation" and lifted.notes["rests"] == "lying"
    assert to_manifold(lifted.surface).genus() == 1


def test_flat_head_on_a_handle_is_not_revolved_and_lies() -> None:
    turner = [(280, 60), (320, 60), (320, 330), (380, 360), (380, 540), (220, 540), (220, 360), (280, 330)]
    lifted = lift(_drawn(turner), NO_HINT)
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "inflation" and lifted.notes["rests"] == "lying"
    assert np.ptp(lifted.surface.vertices[:, 1]) < 0.15


@pytest.mark.parametrize("degrees", [-50, -20, 35, 70])
def test_what_lies_askew_in_the_photo_is_as_long_along_an_axis_as_it_is(degrees: float) -> None:
    turner = [(280, 60), (320, 60), (320, 330), (380, 360), (380, 540), (220, 540), (220, 360), (280, 330)]
    lifted = lift(_drawn(_turned(turner, degrees)), NO_HINT)
    assert lifted.notes["rests"] == "lying"
    assert sorted(np.ptp(lifted.surface.vertices, axis=0)[[0, 2]]) == pytest.approx((160 / 480, 1.0), abs=0.02)


def _blob() -> np.ndarray:
    """A round body with two bulges: it has no mirror axis."""
    around = np.linspace(0, 2 * math.pi, 200)
    bulges = 0.3 * np.exp(-(((around - 0.5) / 0.35) ** 2)) + 0.25 * np.exp(-(((around - 1.9) / 0.3) ** 2))
    radius = 180 * (1 + bulges)
    return _drawn(list(zip(300 + radius * np.cos(around), 300 + radius * np.sin(around), strict=True)))


def test_what_is_round_by_its_name_is_inflated_as_deep_as_it_is_wide() -> None:
    lifted = lift(_blob(), ShapeHint(round=True, stands=False))
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "inflation"
    assert 0.75 < np.ptp(lifted.surface.vertices[:, 1]) / np.ptp(lifted.surface.vertices, axis=0)[[0, 2]].min() < 1.02


@pytest.mark.parametrize("share", [0.1, 0.25])
def test_an_inflated_body_has_the_volume_that_its_name_tells(share: float) -> None:
    lifted = lift(_blob(), ShapeHint(stands=False, volume_share=share))
    assert lifted.notes["primitive"] == "inflation" and lifted.notes["depth_source"] == "prior"
    assert to_manifold(lifted.surface).volume() == pytest.approx(share, rel=0.12)


def test_inflated_strip_is_a_round_bar() -> None:
    mask = np.zeros((80, 400), bool)
    mask[20:60, 10:390] = True
    surface = inflate(mask, depth_limit_px=None, rise=1.0, flat_back=False)
    middle = np.abs(surface.vertices[:, 0] - 200) < 60
    assert surface.vertices[middle, 2].max() == pytest.approx(20, rel=0.08)
    assert surface.vertices[middle, 2].min() == pytest.approx(-20, rel=0.08)


def test_generator_answers_the_protocol_with_the_same_bytes(tmp_path: Path) -> None:
    request = GenerationRequest(_drawn([(200, 100), (400, 100), (430, 500), (170, 500)]), None, "humidifier", seed=0)
    files = []
    for run in range(2):
        generator = LiftGenerator()
        job = generator.submit(request)
        assert generator.poll(job).state == "done"
        (tmp_path / str(run)).mkdir()
        made = generator.fetch(job, tmp_path / str(run))
        assert made.notes["primitive"] == "revolution" and not made.metric
        files.append(made.path.read_bytes())
    assert files[0] == files[1]
    (part,) = read_glb(tmp_path / "0" / "lift.glb")
    solid = trimesh.Trimesh(part.vertices, part.faces, process=True, merge_tex=True, merge_norm=True)
    assert solid.is_watertight and solid.volume > 0 and part.extents.max() == pytest.approx(1.0, abs=1e-6)
    assert part.bounds[0][2] == pytest.approx(0.0, abs=1e-6)


def test_open_container_seen_from_above_is_rejected_not_filled() -> None:
    tray = [(60, 250), (380, 120), (560, 260), (550, 320), (230, 520), (180, 500)]
    with pytest.raises(Rejected, match="open container") as caught:
        lift(_drawn(tray), ShapeHint(container=True, flat=True))
    assert caught.value.reason == "generator_failed"
    assert lift(_drawn(tray), NO_HINT).notes["primitive"] == "inflation"


def test_text_is_refused_with_a_remedy() -> None:
    with pytest.raises(Unsupported, match="no template makes"):
        LiftGenerator().submit(GenerationRequest(None, "a red unicorn", None, seed=0))


def _lifted_photo(path: Path) -> LiftedObject:
    return lift(matte_photo(read_image(path, max_side_px=2048).pixels, path.name).rgba, NO_HINT)


def _check_same_geometry(first: LiftedObject, second: LiftedObject) -> None:
    assert first.notes["primitive"] == second.notes["primitive"]
    extents = [np.ptp(lifted.surface.vertices, axis=0) for lifted in (first, second)]
    assert extents[0] == pytest.approx(extents[1], abs=0.01)
    volumes = [to_manifold(lifted.surface).volume() for lifted in (first, second)]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.15)


@pytest.mark.slow
@pytest.mark.shared_data
def test_turned_photo_gives_the_geometry_of_its_original(shared_data: Path) -> None:
    turned, original = shared_data / "bad" / "exif_rotated.jpg", shared_data / "photos" / "claw_hammer.jpg"
    _check_same_geometry(_lifted_photo(turned), _lifted_photo(original))


@pytest.mark.slow
@pytest.mark.shared_data
def test_photo_in_cmyk_gives_the_geometry_of_its_original(shared_data: Path, tmp_path: Path) -> None:
    original = shared_data / "photos" / "claw_hammer.jpg"
    Image.open(original).convert("CMYK").save(tmp_path / "cmyk.jpg", quality=95)
    _check_same_geometry(_lifted_photo(tmp_path / "cmyk.jpg"), _lifted_photo(original))


@pytest.mark.shared_data
def test_grey_flashlight_lying_is_the_one_standing(shared_data: Path) -> None:
    grey = _lifted_photo(shared_data / "bad" / "gray16.png")
    colour = _lifted_photo(shared_data / "photos" / "flashlight.jpg")
    _check_contract(grey)
    extents = [np.sort(np.ptp(lifted.surface.vertices, axis=0)) for lifted in (grey, colour)]
    assert extents[0][1:] == pytest.approx(extents[1][1:], abs=0.02)
    assert extents[0][0] == pytest.approx(extents[1][0], abs=0.05)  # a facet along its underside, if it lies


@pytest.mark.shared_data
def test_orange_with_garbage_under_its_alpha_is_orange_all_over(shared_data: Path) -> None:
    lifted = _lifted_photo(shared_data / "bad" / "rgba_garbage_under_alpha.png")
    _check_contract(lifted)
    r, g, b = (lifted.texture[..., k].astype(int) for k in range(3))
    assert not ((b > g + 10) & (r > 120)).any()


@pytest.mark.slow
@pytest.mark.shared_data
def test_every_accepted_photo_becomes_a_solid_that_rests(shared_data: Path) -> None:
    lifted = {}
    for path in sorted((shared_data / "photos").glob("*.jpg")):
        try:
            lifted[path.stem] = _lifted_photo(path)
        except Rejected:
            continue
    assert len(lifted) >= 14  # as many as test_matte.py holds to be cut out
    for result in lifted.values():
        _check_contract(result)
    expected = {
        "apple": "revolution",
        "energy_drink_can": "revolution",
        "claw_hammer": "inflation",
        "fake_banana": "inflation",
    }
    assert {name: lifted[name].notes["primitive"] for name in expected} == expected


def painted(shape: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """A photo of 240 pixels with an outline that is true of offsets from its middle, in shares of its side."""
    y, x = (np.mgrid[:240, :240] - 119.5) / 240
    inside = shape(x, y)
    shade = np.clip(200 - 120 * np.abs(x) - 80 * np.abs(y), 0, 255)[..., None]
    return np.dstack([np.repeat(shade, 3, axis=2), 255 * inside]).astype(np.uint8)


def test_a_ball_with_its_mirror_image_is_no_ball() -> None:
    one = painted(lambda x, y: np.hypot(x, y) < 0.3)
    assert generate_from_photo(one, "tennis ball").notes["primitive"] != ""
    beside = painted(lambda x, y: (np.hypot(x, y + 0.2) < 0.2) | (np.hypot(x, y - 0.18) < 0.2))
    with pytest.raises(
        Rejected, match=r"2 bellies .* or one with its mirror image, and one tennis ball has not"
    ) as caught:
        generate_from_photo(beside, "tennis ball")
    assert caught.value.reason == "several_objects"


@pytest.mark.parametrize("degrees", [0, 20])
def test_a_lemon_with_both_its_tips_lies_along_an_axis(degrees: float) -> None:
    around = np.linspace(0, 2 * math.pi, 400)
    reach = 170 + 60 * np.exp(-((np.sin(around) / 0.15) ** 2)) + 20 * np.cos(2 * around)  # a tip at each end
    outline = list(zip(300 + reach * np.cos(around), 300 + reach * np.sin(around), strict=True))
    lifted = lift(_drawn(_turned(outline, degrees)), hint_from_name("lemon"))
    _check_contract(lifted)
    assert (lifted.notes["primitive"], lifted.notes["rests"]) == ("revolution", "lying")
    width, _, depth = np.ptp(lifted.surface.vertices, axis=0)
    assert width == pytest.approx(1.0) and depth == pytest.approx(reach[100] / reach[0], abs=0.05)


@pytest.mark.slow
def test_a_can_seen_nearly_from_above_is_no_egg() -> None:
    around = np.linspace(0, 2 * math.pi, 200)
    askew = _turned(list(zip(300 + 140 * np.cos(around), 300 + 200 * np.sin(around), strict=True)), 14)
    with pytest.raises(Rejected, match="its outline is an ellipse, as a can has none from the side"):
        fit_or_lift(None, _drawn(askew), "can")
    assert fit_or_lift(None, _drawn(_turned([(220, 100), (380, 100), (380, 500), (220, 500)], 14)), "can")
    assert fit_or_lift(None, _drawn(askew), "apple")


@pytest.mark.slow
def test_a_tin_with_its_shadow_and_letters_for_holes_is_no_cushion() -> None:
    def tin(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        open_lid = (np.hypot(x + 0.1, y) < 0.25) | (np.hypot(x - 0.05, y + 0.05) < 0.25)
        shadow = np.hypot(x - 0.12, y - 0.2) < 0.2
        letters = (np.abs(x + 0.12) < 0.05) & (np.abs(y) < 0.03)
        return np.asarray((open_lid | shadow) & ~letters)

    with pytest.raises(Rejected, match="a can is a cylinder, and none has this outline from any side"):
        generate_from_photo(painted(tin), "tin")
    assert generate_from_photo(painted(tin), "toy").notes["primitive"] == "inflation"


@pytest.mark.parametrize(("name", "rests"), [("lemon", "lying"), ("tomato", "standing")])
def test_a_round_fruit_is_turned_about_the_axis_that_gives_its_usual_volume(name: str, rests: str) -> None:
    around = np.linspace(0, 2 * math.pi, 200)
    outline = list(zip(300 + 200 * np.cos(around), 300 + 155 * np.sin(around), strict=True))
    lifted = lift(_drawn(outline), hint_from_name(name))
    _check_contract(lifted)
    assert lifted.notes["primitive"] == "revolution" and lifted.notes["rests"] == rests
    width, height, depth = np.ptp(lifted.surface.vertices, axis=0)
    assert width == pytest.approx(1.0) and height < 0.8  # as in the photo
    assert depth == pytest.approx(155 / 200 if rests == "lying" else 1.0, abs=0.03)


@pytest.mark.parametrize(
    ("name", "extents", "refused"),
    [
        ("golf ball", [0.043, 0.023, 0.022], True),
        ("golf ball", [0.043, 0.042, 0.043], False),
        ("rugby ball", [0.28, 0.19, 0.19], False),
        ("plate", [0.24, 0.011, 0.156], True),
        ("plate", [0.24, 0.02, 0.23], False),
        ("banana", [0.2, 0.04, 0.04], False),
        (None, [0.2, 0.04, 0.04], False),
    ],
)
def test_what_is_round_by_its_name_has_a_round_things_sides(
    name: str | None, extents: list[float], refused: bool
) -> None:
    assert (roundness_conflict(name, np.array(extents)) is not None) == refused


def test_a_helmet_is_no_solid_dome() -> None:
    outline = [(140 + 160 * (1 - math.cos(at)), 380 - 170 * math.sin(at)) for at in np.linspace(0, math.pi, 60)]
    with pytest.raises(Rejected, match="hollow from below"):
        generate_from_photo(_drawn(outline), "hard hat")
