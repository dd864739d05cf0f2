"""Pairs of links that are not tested: found by trying where there is no SRDF."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
from small_arm import box, small_arm

from manitwin.errors import UsageError
from manitwin.robots.load import load_robot, shipped_robots
from manitwin.robots.robot import Robot


def _pairs(path: str) -> set[tuple[str, str]]:
    return set(load_robot(path).disabled_pairs)


def test_adjacent_links_and_the_hands_own_are_disabled_and_distant_ones_are_not(tmp_path: Path):
    pairs = _pairs(small_arm(tmp_path))
    assert pairs == {
        ("base", "upper"),
        ("fore", "upper"),
        ("fore", "panda_palm"),  # the flange between them has no shape
        ("panda_finger_minus", "panda_finger_plus"),
        ("panda_finger_minus", "panda_palm"),
        ("panda_finger_plus", "panda_palm"),
    }


def test_links_that_always_overlap_are_disabled(tmp_path: Path):
    # a box about the elbow, larger than the way to the base, whatever the two joints between them do
    always = _pairs(small_arm(tmp_path, fore=box("0.1 0.1 0.1", "0.05 0 0") + box("2 2 2", "0 0 0")))
    assert ("base", "fore") in always


def test_links_that_overlap_at_home_are_disabled_and_elsewhere_only_are_not(tmp_path: Path):
    upper = box("0.3 0.05 0.05", "0.2 0 0")
    # a post where the forearm comes by at turn = pi / 2
    post = box("0.1 0.1 0.3", "0 0 0.15") + box("0.02 0.02 0.6", "0 0.7 0.3")
    assert ("base", "fore") not in _pairs(small_arm(tmp_path, base=post, upper=upper))
    at_home = small_arm(tmp_path, base=post, upper=upper, toml=("[0.0, 0.5, 0.0]", "[1.5707963, 0.0, 0.0]"))
    assert ("base", "fore") in _pairs(at_home)


def test_an_srdf_is_taken_at_its_word(tmp_path: Path):
    path = small_arm(tmp_path, toml=('file = "small.urdf"', 'file = "small.urdf"\nsrdf = "small.srdf"'))
    (tmp_path / "small.srdf").write_text(
        '<robot name="small"><disable_collisions link1="fore" link2="base" reason="Never"/>'
        '<disable_collisions link1="fore" link2="camera" reason="Never"/></robot>'
    )
    assert ("base", "fore") in _pairs(path)
    (tmp_path / "small.srdf").write_text('<robot name="small"/>')
    with pytest.raises(UsageError, match="it lists no pair of the robot's links"):
        load_robot(path)


@pytest.mark.parametrize("name", shipped_robots())
def test_home_is_free_of_what_is_still_tested_and_many_folded_arms_are_not(name: str):
    robot = load_robot(name)
    model, touching = _collision_test(robot)
    assert not touching(robot.home_rad)
    arm = [model.joints[model.getJointId(joint)].idx_q for joint in robot.arm_joints]
    low, high = model.lowerPositionLimit[arm], model.upperPositionLimit[arm]
    rng = np.random.default_rng(11)
    hits = [touching(rng.uniform(low, high)) for _ in range(150)]
    assert 0 < sum(bool(hit) for hit in hits) < 145
    pairs = set().union(*hits)
    assert any(link in robot.hand_links for pair in pairs for link in pair)  # the hand meets the arm
    # nothing that is always so is left
    assert all(sum(pair in hit for hit in hits) < 0.95 * len(hits) for pair in pairs)


def _collision_test(robot: Robot) -> tuple[Any, Callable[[np.ndarray], set[tuple[str, str]]]]:
    """Return pinocchio's model, and what tells the pairs in contact, by its own reader of URDFs and meshes, as hulls."""
    model = pin.buildModelFromXML(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION, None, [])
    for shape in geometry.geometryObjects:
        if isinstance(shape.geometry, coal.BVHModelBase):
            shape.geometry.buildConvexHull(True, "Qt")
            shape.geometry = shape.geometry.convex
    geometry.addAllCollisionPairs()
    names = [model.frames[shape.parentFrame].name for shape in geometry.geometryObjects]
    pairs = [tuple(sorted((names[pair.first], names[pair.second]))) for pair in geometry.collisionPairs]
    data, results = model.createData(), geometry.createData()

    def touching(arm_rad: np.ndarray) -> set[tuple[str, str]]:
        joints = pin.neutral(model)
        for joint, value in zip(robot.arm_joints, arm_rad, strict=True):
            joints[model.joints[model.getJointId(joint)].idx_q] = value
        pin.computeCollisions(model, data, geometry, results, joints, False)
        found = {pair for pair, result in zip(pairs, results.collisionResults, strict=True) if result.isCollision()}
        return found - set(robot.disabled_pairs)

    return model, touching
