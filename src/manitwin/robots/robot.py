"""A robot as data: an arm with a parallel gripper, as planner and simulation take it.

World frame: the arm's base link at the origin, +Z up, +X forward; the table's top is the plane z = 0 below it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from manitwin.robots.grippers.box import STRICT
from manitwin.robots.grippers.parallel import ParallelGripper


@dataclass(frozen=True)
class Workspace:
    """The part of the table that is reached from above: an annular sector about the base's axis, +X in its middle."""

    __pydantic_config__ = STRICT
    min_radius_m: Annotated[float, Field(ge=0)]
    max_radius_m: Annotated[float, Field(gt=0)]
    half_angle_rad: Annotated[float, Field(gt=0, le=math.pi)]


@dataclass(frozen=True)
class Robot:
    """An arm of n revolute joints and a hand of two prismatic fingers that open by equal amounts.

    ``urdf`` is the whole robot as text, its meshes by absolute path. ``gripper_to_tip (4, 4)`` is the pose of the twin's grasp
    frame (+Z approach, X closing) in the frame of ``tip_link``. ``finger_joints`` go from 0 (closed) to half of the opening;
    the first one's finger is on the side of +X of the grasp frame. ``hand_links`` are the palm, which comes first, and all
    that hangs from it: they may touch the held object. ``finger_links`` are those two that press on it. ``disabled_pairs``
    are pairs of links that are not tested for collision with each other.
    """

    name: str
    sha256: str
    source: str
    urdf: str
    arm_joints: tuple[str, ...]
    finger_joints: tuple[str, str]
    tip_link: str
    gripper_to_tip: np.ndarray
    gripper: ParallelGripper
    hand_links: tuple[str, ...]
    finger_links: tuple[str, str]
    disabled_pairs: tuple[tuple[str, str], ...]
    home_rad: np.ndarray
    velocity_limits_rad_s: np.ndarray
    acceleration_limits_rad_s2: np.ndarray
    workspace: Workspace
