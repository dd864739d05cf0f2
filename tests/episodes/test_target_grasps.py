"""Which grasps an episode gets, and in which order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from manitwin.episodes.planning.problem import Grasp
from manitwin.episodes.target_grasps import TargetGrasp, shuffled, usable_grasps
from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import load_gripper, require_kind
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.grasp_table import SCHEMA
from manitwin.twin.loaded_twin import Twin
from rigid_boxes import FROM_ABOVE, above
from twin_folders import write_accepted

PANDA, WSG, ROBOTIQ = (
    require_kind(load_gripper(name), ParallelGripper) for name in ("panda", "wsg50_110", "robotiq_2f85")
)
DOWN_WXYZ = [0.0, 1.0, 0.0, 0.0]  # FROM_ABOVE


def row(number: int, **values: Any) -> dict[str, Any]:
    """A verified grasp from above with its fingertips' centre at z = 50 mm; ``values`` change it."""
    usual = {
        "grasp_id": f"panda-{number:04d}", "gripper": "panda", "position_m": above([0, 0, 0.05])[:3, 3].tolist(),
        "quaternion_wxyz": DOWN_WXYZ, "width_m": 0.03, "depth_m": PANDA.tip_depth_m, "score": 0.5, "proposer": "antipodal",
        "grasp_point_id": "g0", "outcome": "held", "verified": True, "retired": False,
    }  # fmt: skip
    return {**dict.fromkeys(SCHEMA.names), **usual, **values}


def twin_with(folder: Path, rows: list[dict[str, Any]]) -> Twin:
    """A twin of the Panda with these grasps."""
    identity = write_accepted(folder, 1)
    twin = Twin(next(path for path in folder.rglob("twin.json") if identity in str(path)).parent)
    pq.write_table(pa.Table.from_pylist(rows, schema=SCHEMA), twin.folder / "grasps.parquet")
    return twin


def ids(grasps: tuple[TargetGrasp, ...]) -> list[str]:
    return [grasp.grasp.grasp_id for grasp in grasps]


def test_only_verified_grasps_that_are_not_retired_are_used(tmp_path: Path) -> None:
    rows = [
        row(0), row(1, verified=False, outcome="slips"), row(2, retired=True), row(3, proposer="antipodal:unfiltered"),
        row(4, proposer="antipodal:jittered"), row(5),
    ]  # fmt: skip
    found = usable_grasps(twin_with(tmp_path, rows), PANDA)
    assert ids(found) == ["panda-0000", "panda-0005"]
    assert not found[0].transferred
    assert found[0].grasp_type == "pinch"
    assert found[0].grasp.gripper_to_object == pytest.approx(above([0, 0, 0.05]))


def test_grasp_that_held_in_more_perturbed_trials_is_worth_more_and_without_trials_the_score_counts(
    tmp_path: Path,
) -> None:
    rows = [
        row(0, robustness=1.0, robustness_trials=4), row(1, robustness=1.0, robustness_trials=8),
        row(2, robustness=0.0, robustness_trials=2), row(3, score=0.7),
    ]  # fmt: skip
    values = [grasp.value for grasp in usable_grasps(twin_with(tmp_path, rows), PANDA)]
    assert values == pytest.approx([5 / 6, 9 / 10, 1 / 4, 0.7])


def test_grasp_of_another_parallel_gripper_keeps_its_fingertips_and_says_so(tmp_path: Path) -> None:
    twin = twin_with(tmp_path, [row(0), row(1, width_m=0.079)])
    for gripper in (WSG, ROBOTIQ):
        found = usable_grasps(twin, gripper)
        assert [grasp.transferred for grasp in found] == [True, True]
        tip = found[0].grasp.gripper_to_object @ transform(None, np.array([0, 0, gripper.tip_depth_m]))
        assert tip == pytest.approx(transform(FROM_ABOVE, np.array([0, 0, 0.05])))


def test_transferred_grasp_has_to_fit_between_the_pads(tmp_path: Path) -> None:
    wide = row(1, gripper="wsg50_110", grasp_id="wsg50_110-0001", depth_m=WSG.tip_depth_m, width_m=0.09)
    narrow = row(2, gripper="wsg50_110", grasp_id="wsg50_110-0002", depth_m=WSG.tip_depth_m, width_m=0.06)
    twin = twin_with(tmp_path, [row(0, verified=False, outcome="slips"), wide, narrow])
    twin.record = twin.record.model_copy(
        update={
            "grasps": twin.record.grasps.model_copy(update={"other_grippers": {"wsg50_110": None, "allegro": None}})
        }
    )
    assert ids(usable_grasps(twin, PANDA)) == ["wsg50_110-0002"]
    assert ids(usable_grasps(twin, WSG)) == ["wsg50_110-0001", "wsg50_110-0002"]
    assert not usable_grasps(twin, WSG)[0].transferred


def test_grasps_of_jaws_of_ones_own_are_transferred_and_those_of_cups_and_hands_are_not(tmp_path: Path) -> None:
    others = {"own_jaws": None, "own_cup": None, "own_hand": None}
    rows = [
        row(0, verified=False, outcome="slips"), row(1, gripper="own_jaws", grasp_id="own_jaws-0001", depth_m=0.15),
        row(2, gripper="own_cup", grasp_id="own_cup-0002", width_m=0.0),
        row(3, gripper="own_hand", grasp_id="own_hand-0003", pregrasp_joints_rad=[0.0] * 16, grasp_joints_rad=[0.1] * 16),
    ]  # fmt: skip
    twin = twin_with(tmp_path, rows)
    assert twin.record.grasps is not None
    grasps = twin.record.grasps.model_copy(update={"other_grippers": others})
    twin.record = twin.record.model_copy(update={"grasps": grasps})
    (found,) = usable_grasps(twin, PANDA)
    assert found.grasp.grasp_id == "own_jaws-0001" and found.transferred
    tip = found.grasp.gripper_to_object @ transform(None, np.array([0, 0, PANDA.tip_depth_m]))
    assert tip == pytest.approx(above([0, 0, 0.05]) @ transform(None, np.array([0, 0, 0.15])))


def test_order_is_the_seeds_and_better_grasps_come_sooner_but_not_always() -> None:
    grasps = [TargetGrasp(Grasp(str(i), np.eye(4), 0.03), None, False, 0.5 * (i == 0)) for i in range(4)]
    orders = [ids(shuffled(grasps, np.random.default_rng(seed))) for seed in range(2000)]
    assert orders[7] == ids(shuffled(grasps, np.random.default_rng(7)))
    share = sum(order[0] == "0" for order in orders) / len(orders)
    # Plackett-Luce: exp(6 / 2) against three of exp(0)
    assert share == pytest.approx(np.exp(3) / (np.exp(3) + 3), abs=0.03)
    assert {order[0] for order in orders} == {"0", "1", "2", "3"}
    assert shuffled([], np.random.default_rng(0)) == ()
