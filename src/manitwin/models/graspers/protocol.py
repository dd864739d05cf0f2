"""Protocol of grasp proposers: requests, proposals, and screens that filter proposals before physics trials."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
import trimesh

from manitwin.config import Resource
from manitwin.errors import Rejected
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.grasp_selection import Merits
from manitwin.robots.grippers.gripper import Gripper


@dataclass(frozen=True)
class GraspRequest:
    """An object, a gripper and the points to propose grasps for.

    ``solid`` is the watertight mesh, ``hulls`` the vertices of the convex collision hulls (each ``(V, 3)``), both in the
    object frame in metres. ``focus_points_m (P, 3)`` are the selected points, around which proposals should be denser;
    ``grasp_points_m (G, 3)`` are those of them that are grasp points, and ``grasp_types`` are their grasp types. ``supports``
    are the placements ``object_to_plane (4, 4)`` from which the object will be picked. If ``within_m`` is given, only grasps
    on the surface within that distance of a focus point are useful.
    """

    solid: trimesh.Trimesh
    hulls: tuple[np.ndarray, ...]
    mass_kg: float
    center_of_mass_m: np.ndarray
    object_friction: float
    gripper: Gripper
    focus_points_m: np.ndarray
    max_proposals: int
    seed: int
    grasp_points_m: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    grasp_types: tuple[str, ...] = ()
    supports: tuple[np.ndarray, ...] = ()
    within_m: float | None = None

    @cached_property
    def surface(self) -> RayCaster:
        """Ray caster of the solid."""
        return RayCaster(self.solid)


@dataclass(frozen=True)
class GraspProposals:
    """Grasps in the grasp frame (+Z approach, X closing, origin at the gripper's base).

    ``gripper_to_object (N, 4, 4)``; ``width_m (N,)``, distance of the two contacts along X; ``depth_m (N,)``, position of the
    fingertip centre along +Z; ``score (N,)`` in [0, 1]. For a multi-finger hand ``joints_rad (N, 2, J)`` are the joint angles
    before closing and the targets of closing.
    """

    gripper_to_object: np.ndarray
    width_m: np.ndarray
    depth_m: np.ndarray
    score: np.ndarray
    joints_rad: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.gripper_to_object)

    def take(self, index: np.ndarray) -> GraspProposals:
        """Return the proposals at ``index``."""
        return GraspProposals(
            self.gripper_to_object[index],
            self.width_m[index],
            self.depth_m[index],
            self.score[index],
            None if self.joints_rad is None else self.joints_rad[index],
        )

    @staticmethod
    def joined(parts: list[GraspProposals]) -> GraspProposals:
        """Concatenate proposals; either all parts have joints, or none."""
        joints = [p.joints_rad for p in parts if p.joints_rad is not None]
        return GraspProposals(
            np.concatenate([p.gripper_to_object for p in parts]),
            np.concatenate([p.width_m for p in parts]),
            np.concatenate([p.depth_m for p in parts]),
            np.concatenate([p.score for p in parts]),
            np.concatenate(joints) if joints else None,
        )


class Grasper(Protocol):
    """Protocol of a grasp proposer.

    ``rounds`` limits the number of requests per object (None: as the configuration says). ``propose`` raises BackendError if
    it fails.
    """

    name: str
    model: str | None
    needs: Resource
    rounds: int | None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps, not yet checked for collisions or tried in physics."""
        ...


@dataclass(frozen=True)
class ScreenedProposals:
    """Remaining proposals with measured widths, their merits, and the number of proposals left after each filter."""

    proposals: GraspProposals
    merits: Merits
    counts: dict[str, int]


class Screen(Protocol):
    """Protocol of a filter of proposals for one object and one kind of gripper, before any physics trial."""

    def __call__(self, raw: GraspProposals) -> ScreenedProposals:
        """Return the proposals that are worth a trial."""
        ...

    def why_none(self, counts: dict[str, int]) -> Rejected:
        """Return the rejection that explains why no proposal was left."""
        ...
