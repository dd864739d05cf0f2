"""Texts as shops and people write them: without 'with', in two units, with letters for sides."""

from __future__ import annotations

import numpy as np
import pytest
from told_templates import made_of, read, whole

from manitwin.errors import UsageError
from manitwin.models.generators.templates.looks import COLORS, MATERIALS


def _rgb(word: str) -> tuple[float, ...]:
    return tuple(int(COLORS[word][i : i + 2], 16) / 255 for i in (0, 2, 4))


@pytest.mark.parametrize(
    ("text", "colors"),
    [
        ("a mug, white outside and yellow inside", {"body": "white", "inside": "yellow"}),
        ("a toy car, red body, black wheels, yellow lamps", {"body": "red", "wheels": "black", "lamps": "yellow"}),
        ("a toy car with red rear lamps", {"rear lamps": "red"}),
        ("a spray bottle: body white, trigger red", {"body": "white", "trigger": "red"}),
        ("a keyboard, white, grey keys", {"": "white", "keys": "grey"}),
        ("a bowl in cobalt blue, gold-rimmed", {"": "cobalt blue", "rim": "gold"}),
        ("a mug - red - handle blue", {"": "red", "handle": "blue"}),
        ("a black and white soccer ball", {"pentagons": "black", "body": "white"}),
        ("a dish sponge, yellow and green", {"body": "yellow", "scourer": "green"}),
        ("hammer 500 g red handle", {"handle": "red"}),
        ("black-rimmed glasses", {"frame": "black"}),
        ("casserole 24cm volcanic orange", {"": "orange"}),
        ("a mug whose handle is white", {"handle": "white"}),
        ("a mug, which is blue and has a white handle", {"": "blue", "handle": "white"}),
        ("a plate with a blue rim, 27 cm, white", {"": "white", "rim": "blue"}),
        ("a mug, gold accents", {}),
    ],
)
def test_parts_have_their_colours_without_with(text: str, colors: dict[str, str]) -> None:
    wishes = read(text).wishes
    assert {part: wish.rgb for part, wish in wishes.items()} == {part: _rgb(word) for part, word in colors.items()}


def test_a_colour_of_a_part_that_is_no_slot_is_seen() -> None:
    assert made_of("a power bank with a red buttons").looks["button"].rgb == _rgb("red")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("a wooden-handled chef's knife, blade 20 cm", {"blade": 0.2}),
        ("a magnifying glass, lens 6 cm, wooden handle", {"lens": 0.06}),
        ("a screwdriver, shaft 15 cm, handle 10 cm", {"shaft": 0.15, "handle": 0.1}),
        ("a ladle with a 30 cm handle and a bowl of 9 cm", {"handle": 0.3, "bowl": 0.09}),
        ("a paring knife with blade length 9 cm", {"blade": 0.09}),
        ("a steel-bladed knife with a red plastic handle, blade length 9 cm", {"blade": 0.09}),
        ("Phillips screwdriver PH2 x 100 mm", {"shaft": 0.1}),
    ],
)
def test_lengths_of_parts_are_no_lengths_of_the_whole(text: str, parts: dict[str, float]) -> None:
    assert read(text).part_lengths_m == pytest.approx(parts) and read(text).lengths_m == {}


def test_what_no_part_has_is_refused() -> None:
    with pytest.raises(UsageError, match=r"only the longest side.*'wide'"):
        read("a desk lamp, shade 20 cm wide")
    with pytest.raises(UsageError, match=r"only the longest side.*'wide'"):
        read("a paint roller with a blue handle, roller 23 cm wide")
    with pytest.raises(UsageError, match="a plate has no 'flower' here"):
        made_of("a plate with a green edge and a flower in the middle")
    with pytest.raises(UsageError, match="a serving tray has no 'handle' here"):
        made_of("a tray, 30 x 20 cm, handles black")


@pytest.mark.parametrize(
    ("text", "lengths"),
    [
        ("Stainless steel ruler 12 in / 30 cm", {"": 0.3048}),
        ("a frying pan 28 cm (11 inches)", {"": 0.28}),
        ("a bowl Ø 15 cm", {"width": 0.15}),
        ("a bowl, dia. 15 cm", {"width": 0.15}),
        ("a mug 9 cm (H) x 8 cm (W)", {"height": 0.09, "width": 0.08}),
        ("a cup 8cm D x 10cm H", {"width": 0.08, "height": 0.1}),
        ("box L30 x W20 x H10 cm", {"length": 0.3, "width": 0.2, "height": 0.1}),
        ("box (LxWxH): 30x20x10 cm", {"length": 0.3, "width": 0.2, "height": 0.1}),
        ("box 60 x 40 x 30 cm (W x D x H)", {"width": 0.6, "depth": 0.4, "height": 0.3}),
        ("vase height: 30 cm, width: 12cm", {"height": 0.3, "width": 0.12}),
        ("vase h 30 cm", {"height": 0.3}),
    ],
)
def test_lengths_of_shops_are_read(text: str, lengths: dict[str, float]) -> None:
    assert read(text).lengths_m == pytest.approx(lengths)


@pytest.mark.parametrize(
    ("text", "volume_m3"),
    [
        ("a mug 16oz (473 ml)", 473.176e-6),
        ("a bottle 1 pt", 473.176e-6),
        ("a saucepan 1½ qt", 1.4195e-3),
        ("trash can 13 gal", 49.21e-3),
        ("a glass, 1 UK pint", 568.261e-6),
        ("pill bottle amber 30 dram with white cap", 110.9e-6),
        ("a bucket of 2 imperial gallons", 9.09218e-3),
    ],
)
def test_volumes_of_shops_are_read(text: str, volume_m3: float) -> None:
    amount = read(text).amount
    assert amount is not None and amount.volume_m3 == pytest.approx(volume_m3, rel=1e-3)


def test_amounts_in_two_units_that_differ_are_two() -> None:
    with pytest.raises(UsageError, match="states 16 oz and 300 ml"):
        read("mug 16 oz / 300 ml")
    with pytest.raises(UsageError, match="several lengths"):
        read("a box 12 in / 40 cm")


@pytest.mark.parametrize(
    ("text", "category", "unused"),
    [
        ("Whiteboard Eraser Magnetic, Blue", "whiteboard eraser", {"magnetic"}),
        ("Hex Bolt M10 x 50 zinc plated", "bolt", {"zinc", "plated"}),
        ("the green bowl next to the stove", "bowl", {"stove"}),
        ("one of the oranges", "orange", set()),
        ("Kitchen Scissors Heavy Duty Stainless Steel 21 cm", "scissors", {"heavy", "duty"}),
        ("Spray Bottle 16 oz clear glass with black trigger", "spray bottle", set()),
        ("a carrot lying on the cutting board", "carrot", {"cutting", "board"}),
        ("a white cup with saucer", "cup and saucer", set()),
        ("tongs 12 inch silicone tips", "tongs", {"silicone", "tips"}),
        ("stapler full strip red", "stapler", {"full", "strip"}),
        ("a vase shaped like a bottle", "vase", {"bottle"}),
        ("a rust resistant knife", "knife", {"rust", "resistant"}),
    ],
)
def test_words_behind_a_name_that_are_no_name_are_told(text: str, category: str, unused: set[str]) -> None:
    assert read(text).category == category and set(read(text).unused) == unused


def test_colours_and_materials_at_both_ends_are_of_one_thing() -> None:
    assert whole("Wooden rolling pin 45 cm beech").material == MATERIALS["beech"]
    for text in ("a red jar with a black lid, blue", "a steel rolling pin, beech"):
        with pytest.raises(UsageError, match=r"two (colours|materials) for one object"):
            read(text)
    with pytest.raises(UsageError, match="red and white: state which part has which"):
        read("a jar, red and white lid")


@pytest.mark.parametrize(
    "text",
    [
        "a mug rack red",
        "a mug 9 rack",
        "a mug rack",
        "a button cell battery",
        "a bottle rechargeable charger stand",
    ],
)
def test_a_noun_behind_a_name_makes_it_another_thing(text: str) -> None:
    with pytest.raises(UsageError, match="no template makes"):
        read(text)


@pytest.mark.parametrize(
    ("text", "category"),
    [
        ("a 9V battery", "9v battery"), ("a 9 V block battery", "9v battery"), ("a C battery", "battery"),
        ("a white chess king", "chess king"), ("a walnut knight chess piece", "chess knight"), ("a rook", "chess rook"),
        ("a pawn", "chess piece"), ("a red wooden cube, 4 cm", "cube"), ("a block of wood 20 x 9 x 9 cm", "wood block"),
        ("a yellow rubber duck", "rubber duck"), ("a glass French press, 1 litre", "french press"),
        ("a steel garlic press with a red handle", "garlic press"), ("chrome nail clippers", "nail clipper"),
        ("a box of matches", "matchbox"), ("a lunch box with a green lid", "food container"), ("an ear of corn", "corn"),
        ("a red bell pepper", "bell pepper"), ("a spring clamp with orange pads", "clamp"),
        ("a red alarm clock with brass bells", "alarm clock"), ("an oak block 10 x 5 x 3 cm", "wood block"),
        ("a cube of cheese", "cheese"), ("a tupperware with a red lid, 500 ml", "food container"),
    ],
)  # fmt: skip
def test_what_robots_handle_has_templates_of_its_own(text: str, category: str) -> None:
    """Each of these was refused as another thing than there is a template of."""
    assert read(text).category == category and read(text).unused == ()


def test_a_kind_of_what_is_named_is_told() -> None:
    with pytest.raises(UsageError, match="did you mean building block"):
        read("the blue block")


def test_what_is_seen_through_keeps_its_hue() -> None:
    wish = whole("a transparent blue bottle")
    assert wish.rgb == _rgb("blue") and wish.kind == "clear"
    assert {made_of("a clear blue bottle").looks["body"].surface} <= {"glass", "plastic"}


def test_glass_fibre_is_no_glass() -> None:
    handle = made_of("Claw Hammer, fibreglass handle").looks["handle"]
    assert handle.material == MATERIALS["fibreglass"].material and handle.density_kg_m3 == pytest.approx(1900)
    assert np.allclose(made_of("a hammer with a fiberglass handle").looks["handle"].rgb, handle.rgb)
