"""Flat things on a table: grasps that leave room for the table, and are proven like all others."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from grasp_drafts import PANDA, box_draft, run_all
from manitwin.config import GraspConfig, VerifyConfig
from manitwin.models.graspers.antipodal import AntipodalGrasper
from manitwin.physics.grasp_filters import lowest_points_m
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.grasps import GraspsStage, picked_from
from manitwin.pipeline.verify import VERDICTS, VerifyStage
from manitwin.robots.grippers.parallel import ParallelGripper

SETTINGS = GraspConfig(simulated=20, unfiltered=0, rounds=1, near_enough=20)


def test_a_flat_bar_gets_its_share_of_grasps_that_a_table_leaves_room_for(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.16, 0.02, 0.008], [[0, 0, 0.008], [0.01, 0.01, 0.004]], mass_kg=0.06)
    run_all(
        draft, tmp_path / "work", GraspsStage(SETTINGS, AntipodalGrasper(), PANDA),
        VerifyStage(VerifyConfig(), SapienTrial(), PANDA),
    )  # fmt: skip
    arrays, trials = np.load(draft.path("proposals.npz")), np.load(draft.path(VERDICTS.format("")))
    assert isinstance(PANDA, ParallelGripper)
    clear = lowest_points_m(PANDA, arrays["gripper_to_object"], np.eye(4)) > 0
    share = round(SETTINGS.on_support_share * SETTINGS.simulated)
    assert clear.sum() >= share
    assert (trials["outcome"][clear] == "held").sum() >= share // 2


def test_the_placements_to_pick_from_are_the_likeliest_and_the_likeliest_upright_one() -> None:
    def placement(probability: float, upright: bool, settled: bool, x: float) -> dict[str, object]:
        return {
            "position_m": [x, 0, 0], "quaternion_wxyz": [1, 0, 0, 0], "probability": probability, "upright": upright,
            "settled": settled,
        }  # fmt: skip

    chosen = picked_from(
        [
            placement(0.3, False, True, 1),
            placement(0.6, True, False, 2),
            placement(0.1, True, True, 3),
            placement(0.2, False, True, 4),
        ]
    )
    assert [pose[0, 3] for pose in chosen] == [1, 3]
    assert picked_from([placement(1.0, True, False, 1)]) == ()
