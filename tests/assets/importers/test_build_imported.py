"""Imported assets through the whole pipeline: what they give is kept, and never believed in silence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest

import manitwin
from foreign_assets import mug_urdf
from manitwin.assets.importers.importer import import_assets
from manitwin.config import BuildConfig

QUICK = BuildConfig(
    grasps={"simulated": 12, "unfiltered": 4, "least_per_point": 0},
    second_opinion={"enabled": False},
    robustness={"enabled": False},
)


def built(path: Path, folder: Path) -> manitwin.BuildReport:
    """Import an asset and build it."""
    (one,) = import_assets([path], folder / "imported")
    assert one.folder is not None, one.error
    return manitwin.build(one.folder, folder / "twins", config=QUICK, jobs=1)


def test_mug_of_16_g_is_rejected(tmp_path: Path) -> None:
    # published as such: LIBERO issues 154 and 155
    report = built(mug_urdf(tmp_path / "in", mass_kg=0.016), tmp_path)
    (result,) = report.results
    assert result.status == "rejected" and "implausible_mass" in result.detail
    assert "0.016 kg" in result.detail


@pytest.mark.slow
def test_mug_of_a_mugs_mass_keeps_what_it_gives(tmp_path: Path) -> None:
    (result,) = built(mug_urdf(tmp_path / "in", mass_kg=0.32), tmp_path).results
    assert result.status == "accepted", result.detail
    twin = manitwin.load(result.folder or "", verify=True)
    mass, friction = twin.physical.mass_kg, twin.physical.friction_static
    assert (mass.value, mass.source) == (0.32, "imported:urdf")
    assert (friction.value, friction.source) == (0.55, "imported:urdf")
    assert twin.physical.restitution.source.startswith("prior:")
    assert twin.record.source.file == "source.zip" and twin.record.source.license == "CC0-1.0"
    assert any(check.name == "estimates_agree" for check in twin.record.quality.checks)


@pytest.mark.slow
def test_given_grasps_of_a_twin_are_tried_again(tmp_path: Path) -> None:
    (first,) = built(mug_urdf(tmp_path / "in", mass_kg=0.32), tmp_path).results
    (again,) = built(first.folder or tmp_path, tmp_path / "again").results
    assert again.status == "accepted" and again.twin_id != first.twin_id
    twin = manitwin.load(again.folder or "")
    table = pyarrow.parquet.read_table(twin.folder / "grasps.parquet").to_pydict()
    held = [ok for ok, who in zip(table["verified"], table["proposer"], strict=True) if who == "imported:twin"]
    assert len(held) >= 5 and np.mean(held) > 0.7  # they held in the first twin
    assert twin.record.points is not None
    rationales = [p.rationale for p in (*twin.record.points.functional, *twin.record.points.grasp)]
    assert any(text.startswith("imported:twin: annotated 0 mm") for text in rationales)
