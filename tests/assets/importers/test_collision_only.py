"""Bodies of which nothing is seen: their look is what collides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.assets.importers.importer import import_assets
from manitwin.formats.glb import read_glb
from manitwin.twin.import_record import read_import_record

BALL = '<collision><geometry><sphere radius="0.04"/></geometry></collision>'
SAID = "nothing of it is seen: its collision shapes were taken for what it looks like, grey"


def written(folder: Path, links: str) -> Path:
    path = folder / "ball.urdf"
    path.write_text(f'<robot name="ball">{links}</robot>')
    return path


def test_what_only_collides_is_shown_by_its_collision_shapes(tmp_path: Path) -> None:
    (one,) = import_assets([written(tmp_path, f'<link name="l">{BALL}</link>')], tmp_path / "out")
    assert one.error is None and one.folder is not None
    record = read_import_record(one.folder / "import.json")
    assert SAID in record.remarks
    (part,) = read_glb(one.folder / "asset.glb")
    np.testing.assert_allclose(np.ptp(part.vertices, axis=0), 0.08, rtol=0.02)


def test_what_is_seen_keeps_its_look(tmp_path: Path) -> None:
    seen = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    (one,) = import_assets([written(tmp_path, f'<link name="l">{seen}{BALL}</link>')], tmp_path / "out")
    assert one.folder is not None
    assert SAID not in read_import_record(one.folder / "import.json").remarks
    assert np.ptp(read_glb(one.folder / "asset.glb")[0].vertices, axis=0) == pytest.approx([0.1] * 3)


def test_a_missing_mesh_is_not_made_up_for(tmp_path: Path) -> None:
    gone = '<visual><geometry><mesh filename="gone.stl"/></geometry></visual>'
    (one,) = import_assets([written(tmp_path, f'<link name="l">{gone}{BALL}</link>')], tmp_path / "out")
    assert one.error == "ball.urdf: no visual mesh to make a twin of (gone.stl is missing); put it where its file says"
