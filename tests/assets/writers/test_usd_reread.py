"""The project's own reader against its own USD exports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exported_twins import content
from manitwin.assets.readers.usd import read
from manitwin.assets.writers import usd
from manitwin.assets.writers.exporter import Exporter


@pytest.mark.parametrize("export", [usd.export, usd.export_usdz], ids=["usd", "usdz"])
def test_export_comes_back_as_the_twin(tmp_path: Path, export: Exporter) -> None:
    twin = content(tmp_path / "twin")
    folder = tmp_path / "exported"
    for name, data in export(twin).files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    asset = read(folder)
    physical = twin.physical
    assert asset.remarks == () and asset.missing_files == ()
    assert (asset.up, asset.unit_m, asset.license, asset.attribution) == ("z", 1.0, "CC-BY-4.0", "Ada Lovelace")
    assert (asset.category, asset.captions) == ("Claw hammer", ("A small claw hammer.",))
    assert asset.inertial.mass_kg == pytest.approx(physical.mass_kg.value, rel=1e-6)
    np.testing.assert_allclose(asset.inertial.center_of_mass_m, physical.center_of_mass_m, rtol=1e-6)
    np.testing.assert_allclose(asset.inertial.inertia_kg_m2, physical.inertia_kg_m2, rtol=0, atol=1e-9)
    assert asset.contact.friction_static == pytest.approx(physical.friction_static.value)
    assert [shape.convex for shape in asset.collision] == [True] * len(twin.hulls)
    for shape, (vertices, _) in zip(asset.collision, twin.hulls, strict=True):
        np.testing.assert_allclose(shape.vertices, vertices, atol=1e-7)
    for part, original in zip(asset.visual, twin.visual, strict=True):
        assert part.area == pytest.approx(original.area, rel=1e-5)
    texture = asset.visual[0].visual.material.baseColorTexture
    assert texture.tobytes() == twin.visual[0].visual.material.baseColorTexture.tobytes()
