"""Sizes that standards and makers name, and what a tool or a screen is called by."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.distance import pdist
from told_templates import made_of, read

from manitwin.errors import UsageError

INCH = 0.0254


@pytest.mark.parametrize(
    ("text", "sides_m"),
    [
        ("a notebook A5", (0.210, 0.148)),
        ("A5 hardcover notebook, dotted, 192 pages", (0.210, 0.148)),
        ("a DIN A6 notebook", (0.148, 0.105)),
        ("an A4 notebook (210 x 297 mm)", (0.297, 0.210)),
        ("a notepad, letter size", (11 * INCH, 8.5 * INCH)),
        ("a US letter notebook", (11 * INCH, 8.5 * INCH)),
        ("envelope C5", (0.229, 0.162)),
        ("a DL envelope", (0.220, 0.110)),
        ("envelope #10", (9.5 * INCH, 4.125 * INCH)),
        ("battery AAA", (0.0445, 0.0105)),
        ("a D cell battery", (0.0615, 0.0342)),
        ("AA rechargeable battery 1.2V 2000mAh", (0.0505, 0.0145)),
    ],
)
def test_a_named_size_is_that_of_its_standard(text: str, sides_m: tuple[float, float]) -> None:
    sides = sorted(np.ptp(made_of(text).mesh.vertices, axis=0), reverse=True)
    assert sides[:2] == pytest.approx(sides_m, rel=0.003)


def test_a_toy_brick_has_studs_8_mm_apart_and_is_9_6_mm_high() -> None:
    for text in ("a lego brick 2x4", "LEGO brick 2x4 red", "a 2 x 4 building block"):
        made = made_of(text)
        parts = {
            name: made.mesh.vertices[made.mesh.faces[made.mesh.faces_of(name)]].reshape(-1, 3)
            for name in made.mesh.names
        }
        assert np.ptp(parts["body"], axis=0) == pytest.approx([0.0318, 0.0158, 0.0096], abs=1e-5), text
        tops = parts["studs"][parts["studs"][:, 2] > parts["studs"][:, 2].max() - 1e-6]
        assert np.ptp(tops[:, 0]) - np.ptp(tops[:, 1]) == pytest.approx(2 * 0.008, abs=1e-5), text
    with pytest.raises(UsageError, match="2x4 studs here, none of 2x2"):
        made_of("a lego brick 2x2")


def test_fasteners_have_the_measures_of_their_thread() -> None:
    bolt = made_of("bolt M8x40").mesh
    assert np.ptp(bolt.vertices, axis=0)[0] == pytest.approx(0.0453, abs=1e-5)  # 40 mm and a head of 5.3 mm
    assert np.ptp(bolt.vertices, axis=0).min() == pytest.approx(0.013, abs=1e-4)  # across the flats
    nut = np.sort(np.ptp(made_of("M8 nut").mesh.vertices, axis=0))
    assert nut == pytest.approx([0.0068, 0.013, 0.013 / np.cos(np.pi / 6)], abs=1e-5)
    washer = np.sort(np.ptp(made_of("washer M6").mesh.vertices, axis=0))
    assert washer == pytest.approx([0.0016, 0.012, 0.012], abs=1e-5)


def test_a_tool_is_called_by_its_nuts_and_a_screen_by_its_diagonal() -> None:
    key = np.ptp(made_of("allen key 5 mm").mesh.vertices, axis=0)
    assert min(key) * np.cos(np.pi / 6) == pytest.approx(0.005, rel=1e-3)
    wrench = made_of("wrench 13 mm")
    assert np.prod([wrench.measures[name] for name in ("length_m", "head", "jaw")]) == pytest.approx(0.013, rel=1e-6)
    for text, width_m in (('2" putty knife', 2 * INCH), ("a 4-inch paintbrush", 4 * INCH)):
        assert np.ptp(made_of(text).mesh.vertices, axis=0)[1] == pytest.approx(width_m, rel=1e-3)
    assert np.ptp(made_of("a wrench, 20 cm").mesh.vertices, axis=0).max() == pytest.approx(0.2, rel=1e-6)
    for text in ('laptop 15.6"', "a laptop with a 15.6 inch screen"):
        mesh = made_of(text).mesh
        screen = mesh.vertices[np.unique(mesh.faces[mesh.faces_of("screen")])]
        assert pdist(screen).max() == pytest.approx(15.6 * INCH, rel=1e-3), text
    assert np.ptp(made_of("a laptop, 33 cm long").mesh.vertices, axis=0).max() == pytest.approx(0.33, rel=1e-6)
    with pytest.raises(UsageError, match="a diagonal is told of a screen"):
        read("a mug, 9 cm diagonal")


def test_a_chef_s_knife_is_called_by_its_blade() -> None:
    mesh = made_of("chef's knife 8 inch, german steel, ABS handle").mesh
    faces = mesh.faces[np.isin(mesh.part, [mesh.names.index(name) for name in ("blade", "edge")])]
    assert np.ptp(mesh.vertices[faces.ravel()], axis=0).max() == pytest.approx(8 * INCH, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("shoe size 42", "'size 42' is not understood"),
        ("size 8 shoe", "'size 8' is not understood"),
        ("shoe EU 42", "'eu 42' is not understood"),
        ("a hat, size L", "'size l' is not understood"),
        ("picture frame 4x6", "'4x6' has no unit"),
        ("a mug 9", "'9' has no unit"),
        ("an A4 notebook, 100 x 200 mm", "a size, a4, and a length"),
    ],
)
def test_a_size_that_is_not_understood_is_refused_by_its_word(text: str, cause: str) -> None:
    with pytest.raises(UsageError, match=cause):
        read(text)


@pytest.mark.parametrize(
    ("text", "unused"),
    [
        ("a mug A5", {"a5"}),
        ("notebook A5, 192 pages", {"192", "pages"}),
        ("usb stick 128GB", {"128gb"}),
        ("a 3-in-1 screwdriver", {"3in1"}),
    ],
)
def test_numbers_of_something_else_are_told(text: str, unused: set[str]) -> None:
    assert set(read(text).unused) == unused
