from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.config import CollisionConfig
from manitwin.engine.stage import Draft
from manitwin.errors import Rejected
from manitwin.pipeline.collision import CollisionStage
from manitwin.pipeline.item import Item
from manitwin.pipeline.object_state import load_hulls
from manitwin.pipeline.quality import _collision_checks
from manitwin.twin.record import Hulls
from manitwin.twin.store import canonical_json
from real_meshes import cup


def _draft(folder: Path, mesh: trimesh.Trimesh) -> Draft:
    np.savez(folder / "solid.npz", vertices=mesh.vertices, faces=mesh.faces)
    return Draft("id", Item(None, text="thing"), 0, paths={"solid.npz": folder / "solid.npz"})


def test_cup_gets_hulls_that_keep_it_open(tmp_path: Path) -> None:
    stage = CollisionStage(CollisionConfig())
    field = stage.run(_draft(tmp_path, cup()), tmp_path)["collision"]
    hulls = load_hulls(tmp_path / "hulls.npz")
    assert len(hulls) == field["count"] <= 32
    assert max(len(hull) for hull in hulls) == field["max_vertices"] <= 64
    assert field["keeps_opening"] is True and field["cavity_kept"] > 0.9
    assert field["notes"] == []
    canonical_json(field)
    Hulls(**{key: field[key] for key in Hulls.model_fields})


def test_thing_without_an_opening_is_not_judged_on_it(tmp_path: Path) -> None:
    field = CollisionStage(CollisionConfig()).run(_draft(tmp_path, trimesh.creation.box((0.1,) * 3)), tmp_path)[
        "collision"
    ]
    assert field["keeps_opening"] is None and field["cavity_kept"] is None
    assert field["surface_error_p95_m"] == pytest.approx(0, abs=1e-6)
    assert field["volume_ratio"] == pytest.approx(1.0)


def test_a_hole_that_the_hulls_close_is_a_failed_check(tmp_path: Path) -> None:
    ring = trimesh.creation.annulus(0.02, 0.05, 0.025, sections=96)
    for most, passed in ((32, True), (1, False)):
        draft = _draft(tmp_path, ring)
        draft.fields |= CollisionStage(CollisionConfig(max_hulls=most)).run(draft, tmp_path)
        check = next(check for check in _collision_checks(draft) if check.name == "holes_stay_open")
        assert check.passed is passed
        assert check.value == draft.field("collision")["holes_kept"] == pytest.approx(1.0 if passed else 0.0, abs=0.05)


def test_a_thing_without_a_hole_has_no_check_of_one(tmp_path: Path) -> None:
    draft = _draft(tmp_path, cup())
    draft.fields |= CollisionStage(CollisionConfig()).run(draft, tmp_path)
    assert draft.field("collision")["holes_kept"] is None
    assert "holes_stay_open" not in {check.name for check in _collision_checks(draft)}


def test_one_hull_over_a_cup_is_said_to_close_it(tmp_path: Path) -> None:
    field = CollisionStage(CollisionConfig(max_hulls=1)).run(_draft(tmp_path, cup()), tmp_path)["collision"]
    assert field["keeps_opening"] is False and field["cavity_kept"] < 0.1
    assert field["notes"][0].startswith("opening:")


def test_flat_mesh_is_rejected_as_degenerate(tmp_path: Path) -> None:
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    with pytest.raises(Rejected, match="degenerate"):
        CollisionStage(CollisionConfig()).run(_draft(tmp_path, sheet), tmp_path)


def test_running_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    outputs = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        field = CollisionStage(CollisionConfig()).run(_draft(tmp_path / name, cup()), tmp_path / name)
        outputs.append((canonical_json(field), (tmp_path / name / "hulls.npz").read_bytes()))
    assert outputs[0] == outputs[1]
