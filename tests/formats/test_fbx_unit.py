"""The unit that FBX files say, as text and in binary."""

from __future__ import annotations

import struct

import pytest

from manitwin.formats.fbx_unit import fbx_unit_m


def _word(text: bytes) -> bytes:
    return b"S" + len(text).to_bytes(4, "little") + text


def _binary(number: bytes) -> bytes:
    before = (
        _word(b"OriginalUnitScaleFactor")
        + _word(b"double")
        + _word(b"Number")
        + _word(b"")
        + struct.pack("<cd", b"D", 7.0)
    )
    return before + b"P" + _word(b"UnitScaleFactor") + _word(b"double") + _word(b"Number") + _word(b"") + number


@pytest.mark.parametrize(
    ("data", "unit_m"),
    [
        (_binary(struct.pack("<cd", b"D", 2.54)), 0.0254),
        (_binary(struct.pack("<cf", b"F", 100.0)), 1.0),
        (_binary(struct.pack("<ci", b"I", 100)), 1.0),
        (_binary(struct.pack("<cd", b"D", float("nan"))), 0.01),
        (_binary(struct.pack("<cd", b"D", -1.0)), 0.01),
        (_binary(b"D\x00"), 0.01),
        (_binary(b""), 0.01),
        (
            b'P: "OriginalUnitScaleFactor", "double", "Number", "",7\nP: "UnitScaleFactor", "double", "Number", "",2.54',
            0.0254,
        ),
        (b'P: "UnitScaleFactor", "double", "Number", "",1e2', 1.0),
        (b'P: "UnitScaleFactor", "double", "Number", "",1e', 0.01),
        (b"nothing of it", 0.01),
    ],
)
def test_the_unit_is_told_in_metres(data: bytes, unit_m: float) -> None:
    assert fbx_unit_m(data) == pytest.approx(unit_m)
