"""What the graspers of suction cups and hands propose, and what their screens keep, on shapes whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.models.graspers.postures import PostureGrasper
from manitwin.models.graspers.protocol import GraspProposals, GraspRequest
from manitwin.models.graspers.screens import HandScreen, PadScreen, SealScreen
from manitwin.models.graspers.surface_sampling import AntipodalGrasper, SuctionGrasper
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper

CUP = load_gripper("suction")
assert isinstance(CUP, SuctionGripper)


def request_for(mesh: trimesh.Trimesh, gripper: Gripper, **others: object) -> GraspRequest:
    request = GraspRequest(
        solid=mesh,
        hulls=(np.array(mesh.convex_hull.vertices),),
        mass_kg=0.2,
        center_of_mass_m=np.zeros(3),
        object_friction=0.5,
        gripper=gripper,
        focus_points_m=np.empty((0, 3)),
        max_proposals=800,
        seed=4,
    )
    return replace(request, **others)  # type: ignore[arg-type]


def tips(proposals: GraspProposals) -> np.ndarray:
    poses = proposals.gripper_to_object
    return poses[:, :3, 3] + proposals.depth_m[:, None] * poses[:, :3, 2]


def test_cups_stand_on_the_surface_against_its_normal() -> None:
    sphere = trimesh.creation.icosphere(4, 0.05)
    proposals = SuctionGrasper().propose(request_for(sphere, CUP))
    assert len(proposals) == 800
    assert np.linalg.norm(tips(proposals), axis=1) == pytest.approx(0.05, abs=2e-4)
    inward = -tips(proposals) / 0.05
    assert (proposals.gripper_to_object[:, :3, 2] * inward).sum(1).min() > np.cos(np.radians(3))
    assert np.linalg.det(proposals.gripper_to_object[:, :3, :3]) == pytest.approx(1)


def test_cups_are_kept_on_faces_and_dropped_at_edges() -> None:
    box = trimesh.creation.box([0.1, 0.1, 0.1])
    request = request_for(box, CUP)
    left = SealScreen(request)(SuctionGrasper().propose(request))
    inside_m = np.sort(np.abs(tips(left.proposals)), axis=1)[:, 1]
    assert left.counts["raw"] == 800
    assert 0 < left.counts["after_collision"] < 800
    # the lip is asked at 32 points: a polygon, whose sides are 0.07 mm inside the circle
    least, most = 0.05 - CUP.lip_radius_m, 0.05 - CUP.lip_radius_m * np.cos(np.pi / 32)
    assert inside_m.max() <= most
    raw = np.sort(np.abs(tips(SuctionGrasper().propose(request))), axis=1)[:, 1]
    assert (raw <= least).sum() <= left.counts["after_seal"] <= (raw <= most).sum()


def test_cups_cost_what_they_need_of_the_lip() -> None:
    # a face of a plate: m g (1 + ..) / V grows with the distance from the centre of mass
    plate = trimesh.creation.box([0.3, 0.3, 0.05])
    request = request_for(plate, CUP, mass_kg=0.5)
    left = SealScreen(request)(SuctionGrasper().propose(request))
    below = left.proposals.gripper_to_object[:, 2, 2] < -0.99
    lever = np.linalg.norm(tips(left.proposals)[below][:, :2], axis=1)
    assert np.corrcoef(lever, left.merits.cost[below])[0, 1] > 0.99
    assert left.merits.likely()[below][lever < 0.01].all()
    assert not left.merits.fit[below][lever > 0.1].any()


def test_ball_too_small_for_the_lip_says_so() -> None:
    request = request_for(trimesh.creation.icosphere(3, 0.01), CUP)
    left = SealScreen(request)(SuctionGrasper().propose(request))
    assert not len(left.proposals)
    answer = SealScreen(request).why_none(left.counts)
    assert answer.reason == "no_proposal"
    assert "30 mm" in answer.detail


@pytest.fixture(scope="module")
def hand() -> MultiFingerGripper:
    gripper = load_gripper("allegro")
    assert isinstance(gripper, MultiFingerGripper)
    return gripper


def test_hands_close_across_the_object_around_its_matter(hand: MultiFingerGripper) -> None:
    box = trimesh.creation.box([0.05, 0.05, 0.2])
    proposals = PostureGrasper().propose(request_for(box, hand))
    assert 0 < len(proposals) <= 800
    assert (np.abs(tips(proposals)) <= [0.0251, 0.0251, 0.1001]).all()
    assert proposals.width_m.max() <= hand.opening_m
    assert proposals.joints_rad is not None
    assert proposals.joints_rad.shape == (len(proposals), 2, 16)
    names = {link.joint: link.limits for link in hand.links}
    low, high = np.array([names[joint] for joint in hand.joints]).T
    assert (proposals.joints_rad >= low).all()
    assert (proposals.joints_rad <= high).all()


def test_points_are_held_in_the_posture_of_their_type(hand: MultiFingerGripper) -> None:
    box = trimesh.creation.box([0.05, 0.05, 0.2])
    ends = np.array([[0, 0, 0.1], [0, 0, -0.1]])
    proposals = PostureGrasper().propose(
        request_for(box, hand, focus_points_m=ends, grasp_points_m=ends, grasp_types=("pinch", "power"))
    )
    assert proposals.joints_rad is not None
    pinched = proposals.joints_rad[:, 0, hand.joints.index("joint_9.0")] < 0.2  # the third finger stays away
    upper = tips(proposals)[:, 2] > 0
    assert pinched[upper].mean() > 0.75
    assert pinched[~upper].mean() < 0.25


def test_open_hands_that_are_kept_are_free_of_the_object(hand: MultiFingerGripper) -> None:
    box = trimesh.creation.box([0.05, 0.05, 0.2])
    request = request_for(box, hand)
    raw = PostureGrasper().propose(request)
    left = HandScreen(request)(raw)
    assert 0 < len(left.proposals) < len(raw)
    assert left.proposals.joints_rad is not None
    collision = HandCollision(request.hulls)
    for pose, joints in list(zip(left.proposals.gripper_to_object, left.proposals.joints_rad, strict=True))[:20]:
        assert not collision.boxes_overlap(hand.boxes_at(joints[0]), pose[None], 0.0).any()
    levers = np.linalg.norm(tips(left.proposals), axis=1)
    assert np.corrcoef(levers, left.merits.cost)[0, 1] > 0.9


def test_object_wider_than_the_hand_says_so(hand: MultiFingerGripper) -> None:
    request = request_for(trimesh.creation.icosphere(3, 0.1), hand)
    raw = PostureGrasper().propose(request)
    assert HandScreen(request).why_none({"raw": len(raw), "after_collision": 0}).reason == "too_wide"


def test_wide_things_are_held_where_what_touches_bears_them() -> None:
    """A slab of 6 cm does not turn flat between pads: 8 kg at its edge ask for more than whole pads bear, 0.1 kg for little."""
    panda = load_gripper("panda")
    slab = trimesh.creation.box([0.3, 0.2, 0.06])
    light, heavy = request_for(slab, panda, mass_kg=0.1), request_for(slab, panda, mass_kg=8.0)
    raw = AntipodalGrasper().propose(light)
    kept, none = PadScreen(light)(raw), PadScreen(heavy)(raw)
    assert kept.counts["after_load"] == kept.counts["after_collision"] == len(kept.proposals) > 0
    assert none.counts["after_load"] < none.counts["after_collision"] == kept.counts["after_collision"]
    assert "check the mass" in PadScreen(heavy).why_none({**none.counts, "after_load": 0}).detail
