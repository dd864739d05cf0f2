"""What a text says of one part of a thing."""

from __future__ import annotations

import numpy as np
import pytest
from told_templates import TEMPLATES, made_of, read, whole

from manitwin.errors import UsageError
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.looks import COLORS, MATERIALS
from manitwin.models.generators.templates.object_sampling import make_object


def test_parts_are_described_by_their_name() -> None:
    wanted = read("a small blue mug with a wooden handle")
    assert wanted.relative is not None and wanted.relative < 0.5
    assert wanted.wishes["handle"].material == MATERIALS["wood"] and wanted.wishes[""].rgb is not None


def test_a_part_is_called_by_its_plural_where_that_is_its_name() -> None:
    wanted = read("a red toothbrush with white bristles")
    made = make_object(TEMPLATES["toothbrush"], wanted, np.random.default_rng(0))
    white = tuple(int(COLORS["white"][i : i + 2], 16) / 255 for i in (0, 2, 4))
    assert made.looks["bristles"].rgb == pytest.approx(white)


def test_a_material_that_only_a_part_has_is_that_part_s() -> None:
    made = make_object(TEMPLATES["hammer"], read("a wooden hammer"), np.random.default_rng(1))
    assert made.looks["handle"].material == "wood" and made.looks["head"].surface == "steel"
    assert whole("a wooden spatula").material == whole("a hammer made of wood").material == MATERIALS["wood"]


@pytest.mark.parametrize(
    "text",
    [
        "a hammer with a red handle and a black head",
        "a hammer with a red handle and black head",
        "a hammer with red handle, black head",
        "a black hammer with a red handle",
        "a red-handled black hammer",
    ],
)
def test_every_part_behind_and_has_its_colour(text: str) -> None:
    made = make_object(TEMPLATES["hammer"], read(text), np.random.default_rng(0))
    red, black = (tuple(int(COLORS[c][i : i + 2], 16) / 255 for i in (0, 2, 4)) for c in ("red", "black"))
    assert made.looks["handle"].rgb == pytest.approx(red) and made.looks["head"].rgb == pytest.approx(black)


def test_a_part_without_words_of_its_own_is_as_the_one_before() -> None:
    wishes = read("a teapot with a black handle and lid").wishes
    assert wishes["handle"] == wishes["lid"] != LookRequest()


def test_parts_have_other_names() -> None:
    assert set(read("a jar with a steel lid").wishes) == {"cap"}
    assert set(read("a hammer with a black grip").wishes) == {"handle"}


@pytest.mark.parametrize(
    ("text", "part", "most_kg"), [("a jar with a steel lid", "cap", 0.08), ("a steel mug", "handle", 0.06)]
)
def test_lids_and_handles_of_metal_are_of_sheet(text: str, part: str, most_kg: float) -> None:
    wanted = read(text)
    made = make_object(TEMPLATES[wanted.category], wanted, np.random.default_rng(0))
    assert made.masses_kg[part] < most_kg


def test_what_is_said_behind_a_part_is_that_part_s() -> None:
    for text in ("a mug with the handle in red", "a mug with a handle painted red", "a red handled mug"):
        wishes = read(text).wishes
        assert set(wishes) == {"handle"} and wishes["handle"].rgb == whole("a red mug").rgb
    assert read("a mug with a handle of wood").wishes["handle"].material == MATERIALS["wood"]
    assert set(read("a gold rimmed plate").wishes) == {"rim"}
    assert set(read("a steel-lidded jar").wishes) == {"cap"}
    assert read("a mug with a big handle").unused == ("big",)
    with pytest.raises(UsageError, match="no part is named"):
        read("a green mug with red")


def test_a_colour_of_a_tool_is_its_handle_s() -> None:
    red = tuple(int(COLORS["red"][i : i + 2], 16) / 255 for i in (0, 2, 4))
    for text in (
        "a red claw hammer",
        "hammer, red",
        "red pliers",
        "a red chisel",
        "a red paring knife",
        "red scissors",
    ):
        wanted = read(text)
        assert wanted.wishes == {"handle": LookRequest(red)}, text
    for text in ("a red frying pan", "a red screwdriver", "a red mug", "a red steel hammer", "a silver hammer"):
        assert "" in read(text).wishes, text


@pytest.mark.parametrize(
    ("text", "part", "length_m"),
    [
        ("a chef's knife with a 20 cm blade", "blade", 0.20),
        ("a knife with a 20 cm blade and a 11 cm long wooden handle", "handle", 0.11),
        ("a saucepan 16 cm in diameter and 9 cm high with a 15 cm handle", "handle", 0.15),
    ],
)
def test_a_part_is_as_long_as_is_said(text: str, part: str, length_m: float) -> None:
    mesh = made_of(text).mesh
    names = {part, "edge"} if part == "blade" else {part}  # a blade's edge is a part of its own
    faces = mesh.faces[np.isin(mesh.part, [mesh.names.index(name) for name in names])]
    assert np.ptp(mesh.vertices[faces.ravel()], axis=0).max() == pytest.approx(length_m, rel=0.005)


def test_what_is_said_of_a_part_behind_a_comma_is_of_that_part() -> None:
    wanted = read("phillips head screwdriver, 15 cm, yellow handle")
    assert wanted.category == "screwdriver" and wanted.lengths_m == {"": 0.15}
    assert wanted.wishes == read("a screwdriver with a yellow handle").wishes


def test_a_part_behind_with_is_none_behind_the_comma_before() -> None:
    wanted = read("a plate, 27 cm, white with blue rim")
    assert wanted.wishes == read("a white plate, 27 cm, with a blue rim").wishes
    assert set(wanted.wishes) == {"", "rim"}


def test_a_cork_is_the_stopper_of_a_bottle_and_of_cork() -> None:
    wanted = read("a green glass bottle with a cork, 30 cm")
    assert wanted.wishes["cap"].material is not None and wanted.wishes["cap"].material.material == "cork"
    assert wanted.wishes == read("a green glass bottle with a cork cap, 30 cm").wishes
