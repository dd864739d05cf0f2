"""The grasps and verify stages on a box whose grasps are known, and on things that cannot be gripped."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh

from manitwin.config import GraspConfig, VerifyConfig
from manitwin.errors import Rejected
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.models.graspers.antipodal import AntipodalGrasper
from manitwin.simulate.gripper import Gripper, load_gripper
from manitwin.simulate.rigid_body import RigidBody
from manitwin.simulate.sapien_trial import SapienTrial
from manitwin.simulate.trial import TrialResult, TrialSettings
from manitwin.stages.grasps import GraspsStage
from manitwin.stages.stage import Draft, Item, Stage
from manitwin.stages.verify import VerifyStage
from manitwin.twin import GraspSummary

PANDA = load_gripper("panda")
FEW = GraspConfig(simulated=12, unfiltered=4, raw_per_round=2000, rounds=3, near_enough=200)
COLUMNS = [
    *("grasp_id", "gripper", "position_m", "quaternion_wxyz", "width_m", "depth_m", "score", "proposer"),
    *("grasp_point_id", "functional_point_id", "distance_to_point_m", "outcome", "verified"),
    *("displacement_m", "rotation_rad", "holds_in_second_engine", "robustness", "retired"),
]


def estimate(value: float) -> dict[str, Any]:
    return {"value": value, "low": value, "high": value, "source": "user"}


def draft_of(folder: Path, extents_m: list[float], points: list[list[float]], mass_kg: float = 0.3) -> Draft:
    box = trimesh.creation.box(extents_m)
    box.apply_translation([0, 0, extents_m[2] / 2])
    np.savez(folder / "solid.npz", vertices=box.vertices, faces=box.faces)
    np.savez(folder / "hulls.npz", hull_00=box.vertices)
    x, y, z = np.square(extents_m)
    physical = {
        "mass_kg": estimate(mass_kg),
        "friction_static": estimate(0.5),
        "friction_dynamic": estimate(0.4),
        "center_of_mass_m": [0, 0, extents_m[2] / 2],
        "inertia_kg_m2": (mass_kg / 12 * np.diag([y + z, x + z, x + y])).tolist(),
    }
    functional = [{"id": "f0", "position_m": points[0]}]
    grasp = [{"id": f"g{number}", "position_m": point} for number, point in enumerate(points[1:])]
    draft = Draft("box", Item(None, "box"), seed=3)
    draft.fields.update(physical=physical, points={"functional": functional, "grasp": grasp})
    draft.paths.update({name: folder / name for name in ("solid.npz", "hulls.npz")})
    return draft


def run_grasps(draft: Draft, folder: Path, settings: GraspConfig = FEW) -> dict[str, np.ndarray]:
    draft.fields.update(GraspsStage(settings, AntipodalGrasper(), PANDA).run(draft, folder))
    draft.paths["proposals.npz"] = folder / "proposals.npz"
    return dict(np.load(folder / "proposals.npz"))


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> tuple[Draft, dict[str, np.ndarray], Path]:
    folder = tmp_path_factory.mktemp("bar")
    points = [[0.0, 0.0, 0.25], [0.0, 0.02, 0.04], [0.02, 0, 0.12]]
    draft = draft_of(folder, [0.04, 0.04, 0.25], points)
    proposals = run_grasps(draft, folder)
    draft.fields.update(VerifyStage(VerifyConfig(), SapienTrial(), PANDA).run(draft, folder))
    return draft, proposals, folder


def test_stages_are_stages() -> None:
    assert isinstance(GraspsStage(FEW, AntipodalGrasper(), PANDA), Stage)
    assert isinstance(VerifyStage(VerifyConfig(), SapienTrial(), PANDA), Stage)


def test_chosen_grasps_are_near_a_selected_point_and_named_after_the_nearest(bar: Any) -> None:
    draft, proposals, _ = bar
    chosen = proposals["proposer"] == "antipodal"
    assert chosen.sum() == 12
    assert (proposals["distance_to_point_m"][chosen] <= 0.03).all()
    assert not draft.field("proposals")["association_radius_widened"]
    assert draft.field("proposals")["share_beyond_3cm"] == 0
    tips = proposals["gripper_to_object"][:, :3, 3] + proposals["gripper_to_object"][:, :3, 2] * 0.1034
    low, high = chosen & (tips[:, 2] < 0.05), chosen & (tips[:, 2] > 0.1)
    assert set(proposals["grasp_point_id"][low]) <= {"g0"}
    assert set(proposals["grasp_point_id"][high]) <= {"g1"}


def test_counts_by_filter_fall_and_octants_are_several(bar: Any) -> None:
    field = bar[0].field("proposals")
    counts = list(field["proposed_by_filter"].values())
    assert counts == sorted(counts, reverse=True)
    assert counts[-1] == 12
    assert field["proposed"] == field["proposed_by_filter"]["after_collision"]
    assert field["approach_octants"] >= 4


def test_table_has_the_columns_of_the_contract_and_agrees_with_the_summary(bar: Any) -> None:
    draft, _, folder = bar
    table = pq.read_table(folder / "grasps.parquet")
    assert table.column_names == COLUMNS
    rows = table.to_pydict()
    summary = GraspSummary(**draft.field("grasps"))
    raw = np.array([name.endswith(":unfiltered") for name in rows["proposer"]])
    assert raw.sum() == summary.unfiltered_simulated == 4
    assert sum(np.array(rows["verified"])[~raw]) == summary.verified
    assert summary.simulated == 12
    assert summary.verified + sum(summary.failures.values()) == 12
    assert [outcome == "held" for outcome in rows["outcome"]] == rows["verified"]
    assert rows["holds_in_second_engine"] == rows["robustness"] == [None] * 16
    assert summary.verified >= 11


def test_table_poses_are_gripper_to_object_with_width_along_x(bar: Any) -> None:
    rows = pq.read_table(bar[2] / "grasps.parquet").to_pydict()
    rotation = rotation_from_quaternion_wxyz(np.array(rows["quaternion_wxyz"]))
    tips = np.array(rows["position_m"]) + rotation[:, :, 2] * np.array(rows["depth_m"])[:, None]
    assert (np.abs(tips[:, :2]) <= 0.03).all()
    closing = np.abs(rotation[:, :, 0])
    held = np.array(rows["verified"])
    # the only sides that the stroke takes are the four long ones: closing is horizontal, and as wide as the bar
    assert closing[held, 2].max() < 0.5
    assert np.array(rows["width_m"])[held] == pytest.approx(0.04, abs=0.01)


def test_same_seed_writes_the_same_bytes(bar: Any, tmp_path: Path) -> None:
    draft, _, folder = bar
    again = Draft("box", draft.item, draft.seed, dict(draft.fields), dict(draft.paths))
    run_grasps(again, tmp_path)
    again.fields.update(VerifyStage(VerifyConfig(), SapienTrial(), PANDA).run(again, tmp_path))
    for name in ("proposals.npz", "grasps.parquet"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
    assert again.fields == draft.fields


def test_radius_grows_where_the_points_cannot_be_gripped(tmp_path: Path) -> None:
    # the middle of the broad faces is out of the stroke's reach
    draft = draft_of(tmp_path, [0.04, 0.2, 0.2], [[0.0, 0.1, 0.1], [0.02, 0.0, 0.1]])
    draft.fields["points"]["functional"][0]["position_m"] = [0.02, 0.0, 0.1]
    run_grasps(draft, tmp_path)
    field = draft.field("proposals")
    assert field["association_radius_widened"]
    assert field["association_radius_m"] > 0.03
    assert field["share_beyond_3cm"] == 1


def test_too_wide_box_is_rejected_with_its_smallest_width(tmp_path: Path) -> None:
    draft = draft_of(tmp_path, [0.1, 0.12, 0.14], [[0.05, 0, 0.07], [0, 0.06, 0.07]])
    with pytest.raises(Rejected, match=r"narrowest grip is 100\.0 mm, the panda opens 80 mm") as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_wide"


def test_foil_is_rejected_as_too_thin(tmp_path: Path) -> None:
    draft = draft_of(tmp_path, [0.1, 0.12, 0.0003], [[0.05, 0, 0], [0, 0.06, 0]])
    with pytest.raises(Rejected) as answer:
        run_grasps(draft, tmp_path)
    assert answer.value.reason == "too_thin"


@dataclass
class _NothingHolds:
    """An engine in which every grasp drops: stands in for an object that no real trial fails so completely."""

    name: str = "nothing-holds"

    def run(
        self, body: RigidBody, gripper: Gripper, gripper_to_object: np.ndarray, settings: TrialSettings
    ) -> list[TrialResult]:
        return [TrialResult("drops", 0.03, 0.0, 0.0, (50.0, 50.0), 200)] * len(gripper_to_object)


def test_object_of_which_nothing_holds_is_rejected_with_the_failures(bar: Any, tmp_path: Path) -> None:
    with pytest.raises(Rejected, match="none of 12 simulated grasps held: 12 drops") as answer:
        VerifyStage(VerifyConfig(), _NothingHolds(), PANDA).run(bar[0], tmp_path)
    assert answer.value.reason == "none_held"
