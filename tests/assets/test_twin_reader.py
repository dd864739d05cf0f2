from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from manitwin.assets.read import read_asset
from manitwin.errors import AssetError
from manitwin.twin.dataset_root import twin_name
from twin_folders import OUTCOMES, box, write_accepted, write_rejected


def test_twin_is_read_as_it_says(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1, mass_kg=0.42, grasps=8))
    asset = read_asset(folder)
    record = json.loads((folder / "twin.json").read_text())
    assert asset.format == "twin" and asset.up == "z" and asset.unit_m == 1.0
    assert np.allclose(asset.visual[0].bounds, box().bounds)
    assert asset.inertial.mass_kg == 0.42
    assert np.allclose(asset.inertial.inertia_kg_m2, record["physical"]["inertia_kg_m2"])
    assert asset.contact.friction_static == record["physical"]["friction_static"]["value"]
    assert [frame.kind for frame in asset.frames].count("functional") == len(record["points"]["functional"])
    assert asset.captions[0] == record["language"]["caption"]
    assert len(asset.rests) == len(record["placements"])
    grasps = asset.grasps[0]
    counted = [OUTCOMES[i % len(OUTCOMES)] for i in range(6)]  # the last two are controls
    assert len(grasps.held) == 6 and grasps.held.sum() == counted.count("held")


def test_axis_of_a_points_frame_is_its_normal(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 1))
    points = json.loads((folder / "twin.json").read_text())["points"]["functional"]
    for frame, point in zip(read_asset(folder / "twin.json").frames, points, strict=False):
        assert np.allclose(frame.frame_to_asset[:3, 2], point["normal"])
        assert np.allclose(frame.frame_to_asset[:3, 3], point["position_m"])
        assert np.linalg.det(frame.frame_to_asset[:3, :3]) == pytest.approx(1)


def test_rejected_twin_says_why_it_cannot_be_read(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_rejected(tmp_path, 2))
    with pytest.raises(AssetError, match="two objects"):
        read_asset(folder)


def test_twin_without_its_mesh_is_an_error_that_names_it(tmp_path: Path) -> None:
    folder = tmp_path / twin_name(write_accepted(tmp_path, 3))
    (folder / "visual.glb").unlink()
    with pytest.raises(AssetError, match=r"visual\.glb"):
        read_asset(folder)
