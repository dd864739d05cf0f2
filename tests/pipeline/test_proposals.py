"""Proposals near the selected points: distances, the radius that grows, and room for what the object stands on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from grasp_drafts import PANDA, box_draft, run_all
from manitwin.config import GraspConfig, VerifyConfig
from manitwin.geometry.poses import transform
from manitwin.models.graspers.protocol import GraspProposals
from manitwin.models.graspers.surface_sampling import AntipodalGrasper
from manitwin.physics.grasp_filters import lowest_points_m
from manitwin.physics.grasp_selection import Merits
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.grasps import GraspsStage, pick_support_poses, support_quotas
from manitwin.pipeline.proposals import ScreenedProposals, associate, distances_to_grasps
from manitwin.pipeline.verify import VERDICTS, VerifyStage
from manitwin.robots.grippers.parallel import ParallelGripper


def test_distance_is_measured_from_the_line_between_the_contacts() -> None:
    pose = transform(translation=np.array([0, 0, -0.1]))  # fingertips at the origin, closing along x
    points = np.array([[0.03, 0, 0], [0.05, 0, 0], [0, 0.04, 0], [0.06, 0.03, 0.04]])
    grasp = GraspProposals(pose[None], np.array([0.06]), np.array([0.1]), np.ones(1))
    distance = distances_to_grasps(points, grasp)
    assert distance[0] == pytest.approx([0, 0.02, 0.04, np.sqrt(0.03**2 * 2 + 0.04**2)])


def test_radius_stays_where_enough_are_near() -> None:
    found = associate(np.linspace(0, 0.1, 101), radius_m=0.03, enough=20, object_size_m=0.3)
    assert (found.radius_m, found.widened) == (0.03, False)
    assert found.index.tolist() == list(range(31))


def test_radius_grows_by_half_until_enough_are_near() -> None:
    found = associate(np.linspace(0, 0.1, 101), radius_m=0.03, enough=60, object_size_m=0.3)
    assert found.radius_m == pytest.approx(0.03 * 1.5**2)
    assert found.widened
    assert len(found.index) == 68


def test_radius_ends_at_the_size_of_the_object() -> None:
    found = associate(np.array([0.01, 0.25, 0.4]), radius_m=0.03, enough=100, object_size_m=0.3)
    assert found.radius_m == 0.3
    assert found.index.tolist() == [0, 1]


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


def test_of_what_pads_cannot_bear_a_few_are_asked_for_that_leave_room_for_a_table() -> None:
    """A hand from above over a plane at z = 0: fit at the first thirty places, asked for too much at the others."""
    count, share = 60, 8
    poses = np.repeat(transform(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.2]))[None], count, axis=0)
    poses[:, 0, 3] = np.arange(count) / 100
    made = GraspProposals(poses, np.full(count, 0.02), np.full(count, 0.1), np.ones(count))
    for fit in (np.arange(count) < 30, np.zeros(count, bool)):
        kept = ScreenedProposals(made, Merits(fit, ~fit, np.ones(count), 0.05), np.zeros((count, 1)), made, {})
        settings = SETTINGS.model_copy(update={"simulated": 50})
        (likely, wanted), (free, few) = support_quotas(kept, np.arange(count), PANDA, [np.eye(4)], settings)
        assert (likely == fit).all() and wanted == 20
        assert free.all() and few == share


def test_the_placements_to_pick_from_are_the_likeliest_and_the_likeliest_upright_one() -> None:
    def placement(probability: float, upright: bool, settled: bool, x: float) -> dict[str, object]:
        return {
            "position_m": [x, 0, 0], "quaternion_wxyz": [1, 0, 0, 0], "probability": probability, "upright": upright,
            "settled": settled,
        }  # fmt: skip

    chosen = pick_support_poses(
        [
            placement(0.3, False, True, 1),
            placement(0.6, True, False, 2),
            placement(0.1, True, True, 3),
            placement(0.2, False, True, 4),
        ]
    )
    assert [pose[0, 3] for pose in chosen] == [1, 3]
    assert pick_support_poses([placement(1.0, True, False, 1)]) == ()
