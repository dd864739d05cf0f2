"""The unit of a mesh, as it is said, declared or guessed."""

from __future__ import annotations

import pytest

from manitwin.geometry.length_unit import decide_unit


@pytest.mark.parametrize(
    ("longest", "given", "factor", "metric", "source"),
    [
        (0.24, {}, 1.0, True, "assumed"),
        (240.0, {}, 0.001, True, "guessed"),
        (0.24, {"file_unit_m": 1.0}, 1.0, True, "declared"),
        (24.0, {"file_unit_m": 0.01}, 0.01, True, "declared"),
        (240.0, {"user": "mm"}, 0.001, True, "user"),
        (5.0, {"user": "m"}, 1.0, True, "user"),
        (12.0, {}, 0.001, False, "guessed"),  # 12 mm, 12 cm or 12 inches
        (12.0, {"expected_m": (0.1, 0.14)}, 0.01, True, "guessed"),
        (1.0, {"expected_m": (0.08, 0.13)}, 1.0, False, "unknown"),  # a mug scaled to the unit cube
        (1.0, {}, 1.0, False, "unknown"),
        (1.0, {"expected_m": (0.9, 1.5)}, 1.0, True, "assumed"),  # a walking stick
        (2.0, {"file_unit_m": 1.0}, 1.0, False, "unknown"),  # -1..1, as generators write it
        (0.7, {"file_unit_m": 1.0, "expected_m": (0.08, 0.13)}, 1.0, True, "declared"),
        (0.7, {"expected_m": (0.08, 0.13)}, 1.0, False, "unknown"),
        (60.0, {"file_format": "stl"}, 0.001, True, "guessed"),  # 60 cm would fit, but STL is in millimetres
        (60.0, {"file_format": "obj"}, 0.001, False, "guessed"),
        (35.0, {"file_format": "stl"}, 0.001, True, "guessed"),  # a printed part, as small as many are
        (35.0, {"file_format": "obj"}, 0.001, False, "guessed"),
        (600.0, {"file_format": "stl"}, 0.001, True, "guessed"),  # larger than any printer's bed
        (9.5, {"file_format": "stl"}, 0.001, False, "guessed"),
        (
            48.0,
            {"expected_m": (0.02, 0.38), "file_format": "stl"},
            0.001,
            True,
            "guessed",
        ),  # a chess piece, no garden one
        (3.7, {"expected_m": (0.08, 0.13)}, 0.0254, True, "guessed"),  # a mug in inches
        (1.8, {"expected_m": (0.05, 0.5)}, 0.0254, False, "guessed"),  # a thing of any size, and as likely 1.8 m long
        (165.0, {"file_unit_m": 1.0, "file_format": "glb"}, 0.001, True, "guessed"),  # glTF has no unit but metres
        (165.0, {"file_unit_m": 0.01, "file_format": "dae"}, 0.001, False, "guessed"),  # somebody wrote centimetres
        (165.0, {"file_unit_m": 0.01, "file_format": "dae", "expected_m": (0.1, 0.2)}, 0.001, True, "guessed"),
        (50.4, {"file_unit_m": 0.0254, "file_format": "step"}, 0.0254, True, "declared"),  # a tool of 1.28 m
        (1000.0, {"file_unit_m": 0.001, "file_format": "3mf"}, 0.001, True, "declared"),  # a metre, and no unit cube
        (50.4, {"file_unit_m": 0.0254, "file_format": "step", "user": "mm"}, 0.001, True, "user"),
        (0.89, {"file_unit_m": 1.0, "user": "none"}, 1.0, False, "user"),
    ],
)
def test_units(longest: float, given: dict, factor: float, metric: bool, source: str) -> None:
    unit = decide_unit(longest, **given)
    assert (unit.factor, unit.metric, unit.source) == (factor, metric, source)
    assert (unit.finding is None) == (source in ("user", "declared", "assumed"))


def test_a_finding_says_a_size_only_where_it_is_used() -> None:
    one, several = decide_unit(240.0), decide_unit(12.0)
    assert one.finding is not None and one.finding.endswith("read as millimetres: 0.24 m")
    assert several.finding is not None and "read as" not in several.finding
    assert "millimetres, centimetres, inches would all fit: its scale was not believed; give --units" in several.finding


def test_size_that_no_unit_makes_plausible_is_kept_for_the_gate_to_refuse() -> None:
    unit = decide_unit(1e6)
    assert (unit.factor, unit.metric) == (1.0, True)
    assert unit.finding is not None and "no usual unit" in unit.finding


def test_finding_names_the_unit_that_was_taken() -> None:
    finding = decide_unit(240.121).finding
    assert finding is not None and "millimetres" in finding and "0.24 m" in finding
