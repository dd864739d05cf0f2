from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.assets.importers.importer import import_assets
from manitwin.engine.stage import Draft
from manitwin.pipeline.item import Item
from manitwin.pipeline.quality import findings_of_import

LID = """<robot name="box">
  <link name="box">
    <visual><geometry><box size="0.1 0.06 0.04"/></geometry></visual>
    <visual><geometry><mesh filename="{lid}"/></geometry></visual>
  </link>
</robot>
"""


def _findings(folder: Path, urdf: str) -> list[str]:
    (folder / "box.urdf").write_text(urdf)
    (one,) = import_assets([folder / "box.urdf"], folder / "out")
    assert one.folder is not None, one.error
    item = Item(file=str(one.folder / "asset.glb"), given=str(one.folder / "import.json"))
    return findings_of_import(Draft("id", item, 0, {}, {}))


def test_a_twin_of_an_asset_that_lacks_a_mesh_says_so(tmp_path: Path) -> None:
    (said,) = _findings(tmp_path, LID.format(lid="lid.stl"))
    assert said.startswith("files that the asset names were not there: lid.stl")


@pytest.mark.parametrize("given", [None, "whole"])
def test_a_whole_asset_and_a_plain_mesh_lack_nothing(tmp_path: Path, given: str | None) -> None:
    whole = LID.replace('<mesh filename="{lid}"/>', '<box size="0.1 0.06 0.01"/>')
    assert (
        _findings(tmp_path, whole) if given else findings_of_import(Draft("id", Item(file="a.stl"), 0, {}, {}))
    ) == []
