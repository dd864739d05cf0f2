"""The built-in grasper: what it proposes fits, repeats, and lies where it was asked to look."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.surface_sampling import AntipodalGrasper
from manitwin.robots.grippers.gripper import load_gripper

PANDA = load_gripper("panda")


def request_for(mesh: trimesh.Trimesh, focus_m: list[list[float]], count: int = 4000) -> GraspRequest:
    return GraspRequest(
        solid=mesh,
        hulls=(np.array(mesh.vertices),),
        mass_kg=0.3,
        center_of_mass_m=np.array(mesh.center_mass),
        object_friction=0.5,
        gripper=PANDA,
        focus_points_m=np.array(focus_m).reshape(-1, 3),
        max_proposals=count,
        seed=7,
    )


def tips(proposals: GraspProposals) -> np.ndarray:
    poses = proposals.gripper_to_object
    return poses[:, :3, 3] + poses[:, :3, 2] * proposals.depth_m[:, None]


BAR = trimesh.creation.box([0.03, 0.03, 0.3])


def test_proposals_fit_the_stroke_and_lie_at_the_object() -> None:
    proposals = AntipodalGrasper().propose(request_for(BAR, []))
    assert len(proposals) > 2000
    assert proposals.width_m.max() < PANDA.opening_m
    assert proposals.width_m.min() >= 0.03 - 1e-6
    assert (np.abs(tips(proposals)) <= BAR.extents / 2 + 0.008).all()
    assert proposals.score.min() >= 0
    assert proposals.score.max() <= 1


def test_same_seed_gives_the_same_bytes_and_another_seed_others() -> None:
    request = request_for(BAR, [])
    first, again = AntipodalGrasper().propose(request), AntipodalGrasper().propose(request)
    other = AntipodalGrasper().propose(replace(request, seed=8))
    assert first.gripper_to_object.tobytes() == again.gripper_to_object.tobytes()
    assert first.gripper_to_object.tobytes() != other.gripper_to_object.tobytes()


def test_proposals_are_denser_around_the_selected_points() -> None:
    focus = [0.015, 0, 0.12]
    there = tips(AntipodalGrasper().propose(request_for(BAR, [focus])))
    anywhere = tips(AntipodalGrasper().propose(request_for(BAR, [])))

    def near(points: np.ndarray) -> float:
        return (np.linalg.norm(points - focus, axis=1) < 0.03).mean()

    assert near(there) > 2 * near(anywhere)


def test_grasps_near_the_center_of_mass_score_higher() -> None:
    proposals = AntipodalGrasper().propose(request_for(BAR, []))
    height = np.abs(tips(proposals)[:, 2])
    assert proposals.score[height < 0.02].min() > proposals.score[height > 0.13].max()


@pytest.mark.parametrize("extents_m", [[0.09, 0.1, 0.12], [0.081, 0.081, 0.081]])
def test_nothing_is_proposed_for_a_box_wider_than_the_stroke(extents_m: list[float]) -> None:
    assert len(AntipodalGrasper().propose(request_for(trimesh.creation.box(extents_m), []))) == 0
