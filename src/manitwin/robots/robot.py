"""Robot model: an arm with a hand of any kind of gripper, as planner and simulation use it.

World frame: the arm's base link at the origin, +Z up, +X forward; the table top is the plane z = 0. For two arms, the origin
is at the first arm's base.
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
    """Part of the table that is reachable from above: an annular sector about the base's axis, centred on +X."""

    __pydantic_config__ = STRICT
    min_radius_m: Annotated[float, Field(ge=0)]
    max_radius_m: Annotated[float, Field(gt=0)]
    half_angle_rad: Annotated[float, Field(gt=0, le=math.pi)]


@dataclass(frozen=True)
class Robot:
    """An arm of n revolute joints with a hand: two coupled jaws, a suction cup, or a multi-finger hand.

    ``urdf`` is the whole robot as text, with meshes by absolute path. ``gripper_to_tip (4, 4)`` is the pose of the twin's
    grasp frame (+Z approach, X closing) in the frame of ``tip_link``. ``finger_joints`` are all joints of the hand: those of
    jaws range from 0 (closed) to half of the opening, and the first one's finger is on the +X side of the grasp frame; that
    of a cup is its spring-loaded plunger; those of a multi-finger hand are in the order of its gripper file. ``hand_links``
    are the palm, which comes first, and all links below it; they may touch the held object. ``finger_links`` are the links
    that press on it. ``disabled_pairs`` are link pairs excluded from self-collision tests.

    The two ``arms`` of a two-arm robot (``two_arms``) are robots of their own, each with its base in the world and the same
    parallel hand. Joints, links and limits are then those of the first arm followed by those of the second; ``tip_link``,
    ``gripper_to_tip`` and ``workspace`` are those of the first. A single-arm robot has no ``arms``.

    ``velocity_limits_rad_s`` are the limits for planning, ``fastest_rad_s`` the URDF's own, which the arm cannot exceed.
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
        """Whether the hand is a parallel gripper."""
        return isinstance(self.gripper, ParallelGripper)

    @property
    def hand_state_names(self) -> tuple[str, ...]:
        """Names of the recorded hand state: the opening of jaws, otherwise the joints (rad or m)."""
        if self.arms:
            return tuple(f"{arm.name}_{OPENING}" for arm in self.arms)
        return (OPENING,) if self.has_jaws else self.finger_joints

    @property
    def hand_action_names(self) -> tuple[str, ...]:
        """Names of the hand commands: the opening of jaws, whether a cup's vacuum is on (0 or 1), or the joints."""
        return (VACUUM,) if isinstance(self.gripper, SuctionGripper) else self.hand_state_names

    @property
    def open_hand(self) -> np.ndarray:
        """Initial positions ``(J,)`` of ``finger_joints``: the open hand; for a cup 0, where the lip is in its nominal plane."""
        if self.arms:
            return np.concatenate([arm.open_hand for arm in self.arms])
        if isinstance(self.gripper, MultiFingerGripper):
            return self.gripper.postures[0].joints_at(np.array(self.gripper.postures[0].openings_m[-1]))
        return self.hand_joints(np.array([self.gripper.opening_m if self.has_jaws else 0.0]))

    def hand_joints(self, hand_state: np.ndarray) -> np.ndarray:
        """Return the positions ``(J,)`` of ``finger_joints`` for a recorded hand state ``(h,)``."""
        return np.repeat(hand_state / 2, 2) if self.has_jaws else np.asarray(hand_state, float)

    def contact_side(self, link: str) -> int | None:
        """Return on which side of the held object a link presses, 0 or 1; None if it is not meant to press.

        Side 0 is the first jaw, a cup, or thumb and palm; side 1 is the second jaw or the other fingers.
        """
        if isinstance(self.gripper, MultiFingerGripper):
            owners = {
                each.name: owner for each, owner in zip(self.gripper.links, self.gripper.finger_of_link, strict=True)
            }
            return None if link not in owners else int(owners[link] > 0)
        return self.finger_links.index(link) if link in self.finger_links else None
