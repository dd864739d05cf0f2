"""Lengths, amounts and masses that a text states, and what is made of them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from told_templates import TEMPLATES, made_of, read

from manitwin.errors import UsageError
from manitwin.models.generators.templates.object_sampling import make_object


@pytest.mark.parametrize(
    ("text", "lengths"),
    [
        ("a mug, 9 cm", {"": 0.09}),
        ("mug 95 mm tall", {"height": 0.095}),
        ("a plate 10 inches wide", {"width": 0.254}),
        ("ruler, 0.3 m long", {"length": 0.3}),
        ("a 12cm glass", {"": 0.12}),
        ("a 1,5 cm dice", {"": 0.015}),
        ("a mug, 9,5 cm tall", {"height": 0.095}),
        ("a rolling pin of 1,000 mm", {"": 1.0}),
        ("a mug 9 centimetres tall", {"height": 0.09}),
        ("a ruler, 0.3 meters", {"": 0.3}),
        ('a 4" ruler', {"": 0.1016}),
        ("a plate 10 in. wide", {"width": 0.254}),
        ("a 1 foot ruler", {"": 0.3048}),
        ("a mug 5 1/2 inches tall", {"height": 0.1397}),
        ("a mug with a height of 9 cm", {"height": 0.09}),
        ("a mug 9 cm in height", {"height": 0.09}),
        ("a red mug with a wooden handle, 9 cm tall", {"height": 0.09}),
        ("a mug of the 70's", {}),
        ("an umbrella 3' long", {"length": 0.9144}),
        ("a six-inch spoon", {"": 0.1524}),
        ("a skillet, ten inches", {"": 0.254}),
        ("a spoon of ½ ft", {"": 0.1524}),
        ("a 3/4 foot long spoon", {"length": 0.2286}),
        ("a 5-1/2 inch mug", {"": 0.1397}),
        ("a hammer, 1 foot 2 inches long", {"length": 0.3556}),
        ("a hammer 1'2\" long", {"length": 0.3556}),
        ("a ruler, .3 m", {"": 0.3}),
        ("a screwdriver of 0.1524 m", {"": 0.1524}),
        ("a spoon, 2 dm", {"": 0.2}),
        ("a yard long umbrella", {}),
        ("an umbrella, 1 yard", {"": 0.9144}),
        ("a 10 km mug", {"": 1e4}),
        ("a two in one mug", {}),
    ],
)
def test_lengths_are_read_with_their_unit_and_direction(text: str, lengths: dict[str, float]) -> None:
    assert read(text).lengths_m == pytest.approx(lengths)


@pytest.mark.parametrize(
    ("text", "mass_kg", "extent_m"),
    [("a 60 g egg", 0.06, None), ("an orange, 8 cm", None, 0.08), ("a soccer ball", 0.43, 0.219)],
)
def test_food_and_balls_have_the_stated_size_and_the_usual_mass(
    text: str, mass_kg: float | None, extent_m: float | None
) -> None:
    wanted = read(text)
    thing = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
    assert mass_kg is None or sum(thing.masses_kg.values()) == pytest.approx(mass_kg, rel=0.05)
    assert extent_m is None or np.ptp(thing.mesh.vertices, axis=0).max() == pytest.approx(extent_m, rel=0.02)


def test_luggage_is_measured_by_its_sides_from_the_longest() -> None:
    for text in ("a suitcase 55 x 40 x 20 cm", "a suitcase 40 cm wide, 55 cm tall and 20 cm deep"):
        made = made_of(text)
        assert np.ptp(made.mesh.vertices, axis=0) == pytest.approx([0.4, 0.2, 0.55], rel=0.003)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("a mug 9 cm tall, 12 cm high", "several lengths"),
        ("a mug of 9-10 cm", "several lengths"),
        ("a mug, 9 to 10 cm tall", "several lengths"),
        ("a small large mug", "two sizes for one object, small and large"),
        ("a mug of 300 to 350 ml", "states a range"),
        ("a mug of 300 g, 9 cm tall", "states 300 g and a length"),
        ("a 300 ml mug of 300 g", "states 300 ml and 300 g"),
        ("a 5 l mug, 9 cm tall", "no mug can be given all of this"),
        ("a fork of 200 ml, 20 cm long", "not a container"),
        ("a fork of 200 ml", "not a container"),
        ("a 500 ml leather bottle", "its wall is not"),
        ("a mug of 0 ml", "no size gives"),
        ("a mug 10 cm tall and 80 cm wide", r"no mug can be given all of this .*its width would be"),
        ("a box 0 x 20 x 10 cm", "no box can be given all of this"),
        ("a box of 2 m x 2 m x 10 cm", "check the unit"),
        ("a mug with a 3 cm saucer", "no 'saucer' here"),
        ("a mug without a handle", "cannot use a negation"),
    ],
)
def test_what_a_template_cannot_be_told_is_refused_and_not_left_out(text: str, cause: str) -> None:
    with pytest.raises(UsageError, match=cause):
        made_of(text)


def test_stated_size_is_the_size() -> None:
    for text, axis, size_m in (
        ("mug 10 cm tall", 2, 0.10),
        ("a plate 26 cm wide", 0, 0.26),
        ("ruler 30 cm long", 0, 0.30),
    ):
        wanted = read(text)
        thing = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
        assert np.ptp(thing.mesh.vertices, axis=0)[axis] == pytest.approx(size_m, rel=1e-6)


@pytest.mark.parametrize("text", ["a mug 3 m tall", "hammer, 2 mm", "a mug with a red wheel"])
def test_what_no_such_thing_has_is_refused(text: str) -> None:
    wanted = read(text)
    with pytest.raises(UsageError):
        make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("text", "side", "size_m"),
    [
        *(
            ("a keyboard, 40 cm wide", 0, 0.4),
            ("a cutting board 20 cm wide", 1, 0.2),
            ("a cardboard box 30 cm long", 2, 0.3),
        ),
        ("a bottle 25 cm long", 2, 0.25),
    ],
)
def test_the_side_that_is_meant_is_one_that_gives_a_usual_size(text: str, side: int, size_m: float) -> None:
    wanted = read(text)
    made = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
    assert np.ptp(made.mesh.vertices, axis=0)[side] == pytest.approx(size_m, rel=1e-6)


def test_a_length_of_a_pan_is_its_diameter_and_not_that_of_its_handle() -> None:
    for text, diameter_m in (("a 10-inch frying pan", 0.254), ("a 20 cm saucepan", 0.2), ("a 24 cm pot", 0.24)):
        wanted = read(text)
        extents = np.ptp(
            make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0)).mesh.vertices, axis=0
        )
        assert extents[1] == pytest.approx(diameter_m, rel=1e-3) and extents[0] > 1.3 * diameter_m, text
    long = make_object(TEMPLATES["frying pan"], read("a frying pan, 45 cm long"), np.random.default_rng(0))
    assert np.ptp(long.mesh.vertices, axis=0).max() == pytest.approx(0.45, rel=1e-6)


@pytest.mark.parametrize("text", ["a -9 cm mug", "a mug (-9 cm)", "a mug, height: -3.5 in"])
def test_a_length_below_zero_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="a negative length"):
        read(text)


@pytest.mark.parametrize("text", ["a 9-cm mug", "a mug - 9 cm tall", "a T-9 mug"])
def test_a_dash_is_no_sign(text: str) -> None:
    assert read(text).category == "mug"


def test_a_thing_that_is_stated_small_has_walls_that_can_be_made() -> None:
    for text in ("a steel mug, 7 cm", "a steel bowl, 7 cm", "a tiny steel mug"):
        wanted = read(text)
        made = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
        assert made.measures["wall_m"] > 0.00079, text
        if wanted.lengths_m:
            assert np.ptp(made.mesh.vertices, axis=0).max() == pytest.approx(0.07, rel=1e-6), text


@pytest.mark.parametrize(
    ("text", "extents_m"),
    [
        ("a cardboard box 30 x 20 x 15 cm", (0.30, 0.20, 0.15)),
        ("a box of 30cmx20cmx10cm", (0.30, 0.20, 0.10)),
        ("a box 0.3 m x 20 cm x 150 mm", (0.30, 0.20, 0.15)),
        ("a pizza box, 33 by 33 by 4 cm", (0.33, 0.33, 0.04)),
        ("a box 20 cm wide, 10 cm deep and 30 cm tall", (0.20, 0.10, 0.30)),
        ('a serving tray, 12 x 16"', (0.4064, 0.3048, None)),
        ("a white porcelain bowl, 15cm wide and 7 cm high", (0.15, 0.15, 0.07)),
        ("a mug, height 10 cm, diameter 8 cm", (None, 0.08, 0.10)),
        ("a bottle 7 x 25 cm", (0.07, 0.07, 0.25)),
        ("a bowl 15 x 7 cm", (0.15, 0.15, 0.07)),
        ("a dinner plate, 27 x 2.5 cm", (0.27, 0.27, 0.025)),
        ("candle 7 x 10 cm", (0.07, 0.07, 0.10)),  # drawn slender, its two sides across are alike
        ("a frying pan of 28 cm, 5 cm deep", (None, 0.28, 0.05)),
        ("a hammer 30 cm long and 12 cm wide", (0.30, 0.12, None)),
        ("a mug, 9 cm tall, 300 ml", (None, None, 0.09)),
        ("a 500 ml water bottle 22 cm high", (None, None, 0.22)),
    ],
)
def test_several_lengths_are_the_sides_of_what_is_made(text: str, extents_m: tuple[float | None, ...]) -> None:
    for side, said in zip(np.ptp(made_of(text).mesh.vertices, axis=0), extents_m, strict=True):
        assert said is None or side == pytest.approx(said, rel=0.005)


@pytest.mark.parametrize(
    ("text", "volume_m3"),
    [
        ("a 250 ml mug", 250e-6),
        ("a half-litre beer glass", 500e-6),
        ("a 10 l bucket", 0.010),
        ("a wine glass, 35 cl", 350e-6),
        ("a 16 fl oz mug", 473.2e-6),
        ("a 1 litre pitcher", 1e-3),
        ("a 2 litre saucepan", 2e-3),
        ("a mug, 9 cm tall, 300 ml", 300e-6),
    ],
)
def test_an_open_vessel_holds_as_much_as_is_said(text: str, volume_m3: float) -> None:
    """Measured by level sections, of whose loops around the axis the inner one is the hollow's outline."""
    made = made_of(text)
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    low, high = solid.bounds[:, 2]
    levels = np.linspace(low, high, 202)[1:-1]
    held = [_hollow_m2(solid, level) * (high - low) / len(levels) for level in levels]
    assert sum(held) == pytest.approx(volume_m3, rel=0.02)


def _hollow_m2(solid: trimesh.Trimesh, level_m: float) -> float:
    section = solid.section(plane_origin=[0, 0, level_m], plane_normal=[0, 0, 1])
    loops = [] if section is None else [loop[:, :2] for loop in section.discrete]
    around = []
    for loop in loops:
        x, y = loop.T
        turns = np.unwrap(np.arctan2(y, x))
        if abs(turns[-1] - turns[0]) > np.pi:
            around.append(0.5 * abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])))
    return min(around) if len(around) > 1 else 0.0


@pytest.mark.parametrize(
    ("text", "outside_m3"),
    [
        ("a 500 ml water bottle of plastic 22 cm high", 500e-6),
        ("a 500 ml plastic water bottle", 500e-6),
        ("a 12 oz soda can", 354.9e-6),
        ("a 330 ml can", 330e-6),
        ("a 1 litre milk carton", 1000e-6),
    ],
)
def test_a_closed_vessel_of_a_thin_wall_is_as_large_as_what_it_holds(text: str, outside_m3: float) -> None:
    made = made_of(text)
    body = made.solids[list(made.masses_kg).index("body")][0]
    assert outside_m3 < body.volume() < 1.08 * outside_m3


@pytest.mark.parametrize(
    ("text", "mass_kg"), [("a 2 kg dumbbell", 2.0), ("a mug weighing 300 g", 0.3), ("a 1 lb hammer", 0.4536)]
)
def test_a_thing_weighs_what_is_said(text: str, mass_kg: float) -> None:
    assert sum(made_of(text).masses_kg.values()) == pytest.approx(mass_kg, rel=0.006)
