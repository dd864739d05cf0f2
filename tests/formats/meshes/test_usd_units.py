"""Units of USD stages, as its classes and other programs write them."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from pxr import Tf, Usd, UsdGeom, UsdPhysics

from manitwin.assets.readers.usd import read_here
from manitwin.formats.meshes.usd_units import kilograms_per_unit, metres_per_unit

INLINED = 0x40
DOUBLE, FLOAT = 9, 8
"""Types of values in USD's binary files, of which a short one stands in the place of its offset."""


def cube(path: Path, unit_m: float | None) -> Path:
    """A cube of two units."""
    stage = Usd.Stage.CreateNew(str(path))
    if unit_m is not None:
        UsdGeom.SetStageMetersPerUnit(stage, unit_m)
    stage.SetDefaultPrim(UsdGeom.Cube.Define(stage, "/cube").GetPrim())
    stage.Save()
    return path


def in_single_precision(path: Path, number: float) -> None:
    """Make a number of a binary file one of single precision."""
    rep = struct.pack("<fBBBB", number, 0, 0, DOUBLE, INLINED)
    written = path.read_bytes()
    assert written.count(rep) == 1
    path.write_bytes(written.replace(rep, struct.pack("<fBBBB", number, 0, 0, FLOAT, INLINED)))


def test_a_unit_in_single_precision_counts(tmp_path: Path) -> None:
    path = cube(tmp_path / "cube.usdc", 0.5)
    in_single_precision(path, 0.5)
    stage = Usd.Stage.Open(str(path))
    with pytest.raises(Tf.ErrorException, match="metersPerUnit does not match"):
        UsdGeom.GetStageMetersPerUnit(stage)
    assert metres_per_unit(stage) == 0.5
    assert read_here(path).visual[0].extents.tolist() == pytest.approx([1.0, 1.0, 1.0])


def test_what_a_stage_does_not_say_is_none(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(cube(tmp_path / "cube.usda", None)))
    assert (metres_per_unit(stage), kilograms_per_unit(stage)) == (None, None)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 0.001)
    assert kilograms_per_unit(stage) == 0.001


def test_the_session_overrides_the_file(tmp_path: Path) -> None:
    stage = Usd.Stage.Open(str(cube(tmp_path / "cube.usda", 0.5)))
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        UsdGeom.SetStageMetersPerUnit(stage, 0.001)
    assert metres_per_unit(stage) == 0.001 == UsdGeom.GetStageMetersPerUnit(stage)
