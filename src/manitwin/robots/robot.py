"""A robot as data: an arm with a hand of any kind of gripper, as planner and simulation take it.

World frame: the arm's base link at the origin, +Z up, +X forward; the table's top is the plane z = 0 below it. Of two arms
the first one's base is there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from manitwin.robots.grippers.box import STRICT
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

OPENING, VACUUM = "gripper_opening_m", "vacuum"


@dataclass(frozen=True)
class Workspace:
    """The part of the table that is reached from above: an annular sector about the base's axis, +X in its middle."""

    __pydantic_config__ = STRICT
    min_radius_m: Annotated[float, Field(ge=0)]
    max_radius_m: Annotated[float, Field(gt=0)]
    half_angle_rad: Annotated[float, Field(gt=0, le=math.pi)]


@dataclass(frozen=True)
class Robot:
    """An arm of n revolute joints and a hand: two jaws that open by equal amounts, a suction cup, or fingers with joints.

    ``urdf`` is the whole robot as text, its meshes by absolute path. ``gripper_to_tip (4, 4)`` is the pose of the twin's grasp
    frame (+Z approach, X closing) in the frame of ``tip_link``. ``finger_joints`` are all joints of the hand. Those of jaws
    go from 0 (closed) to half of the opening, the first one's finger on the side of +X of the grasp frame; a cup's is that
    of its spring plunger; those of a hand with more joints are in the order of its gripper's file. ``hand_links`` are the palm,
    which comes first, and all that hangs from it: they may touch the held object. ``finger_links`` are those that press on
    it. ``disabled_pairs`` are pairs of links that are not tested for collision with each other.

    Two ``arms`` (``two_arms``) are robots of their own, each with its base in the world and the same hand of two jaws: joints,
    links and limits are then those of the first, then of the second; ``tip_link``, ``gripper_to_tip`` and ``workspace`` those
    of the first. A robot of one arm has none.

    ``velocity_limits_rad_s`` are those that plans keep within, ``fastest_rad_s`` the URDF's own, which no arm exceeds.
    """

    name: str
    sha256: str
    source: str
    urdf: str
    arm_joints: tuple[str, ...]
    finger_joints: tuple[str, ...]
    tip_link: str
    gripper_to_tip: np.ndarray
    gripper: Gripper
    hand_links: tuple[str, ...]
    finger_links: tuple[str, ...]
    disabled_pairs: tuple[tuple[str, str], ...]
    home_rad: np.ndarray
    velocity_limits_rad_s: np.ndarray
    fastest_rad_s: np.ndarray
    acceleration_limits_rad_s2: np.ndarray
    workspace: Workspace
    arms: tuple[Robot, ...] = ()

    @property
    def has_jaws(self) -> bool:
        """Whether the hand is one of two jaws."""
        return isinstance(self.gripper, ParallelGripper)

    @property
    def hand_state_names(self) -> tuple[str, ...]:
        """The names of what is recorded of the hand: the opening of jaws, else its joints (rad, or m)."""
        if self.arms:
            return tuple(f"{arm.name}_{OPENING}" for arm in self.arms)
        return (OPENING,) if self.has_jaws else self.finger_joints

    @property
    def hand_action_names(self) -> tuple[str, ...]:
        """The names of what the hand is told: the opening of jaws, whether a cup's vacuum is on (0, 1), or its joints."""
        return (VACUUM,) if isinstance(self.gripper, SuctionGripper) else self.hand_state_names

    @property
    def open_hand(self) -> np.ndarray:
        """The positions ``(J,)`` of ``finger_joints`` that a robot begins with: open; a cup where it is pressed on."""
        if self.arms:
            return np.concatenate([arm.open_hand for arm in self.arms])
        if isinstance(self.gripper, MultiFingerGripper):
            return self.gripper.postures[0].joints_at(np.array(self.gripper.postures[0].openings_m[-1]))
        return self.hand_joints(np.array([self.gripper.opening_m if self.has_jaws else 0.0]))

    def hand_joints(self, hand_state: np.ndarray) -> np.ndarray:
        """Return the positions ``(J,)`` of ``finger_joints`` of a recorded state ``(h,)`` of the hand."""
        return np.repeat(hand_state / 2, 2) if self.has_jaws else np.asarray(hand_state, float)

    def side_of(self, link: str) -> int | None:
        """Return on which of the two sides of what is held a link presses: 0 or 1; None: it is to press on neither.

        The first jaw, a cup, or thumb and palm are 0; the second jaw, or the other fingers, are 1.
        """
        if isinstance(self.gripper, MultiFingerGripper):
            owners = {
                each.name: owner for each, owner in zip(self.gripper.links, self.gripper.finger_of_link, strict=True)
            }
            return None if link not in owners else int(owners[link] > 0)
        return self.finger_links.index(link) if link in self.finger_links else None
