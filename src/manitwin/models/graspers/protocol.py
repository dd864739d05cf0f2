"""The protocol of a grasp proposer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import trimesh

from manitwin.simulate.gripper import Gripper


@dataclass(frozen=True)
class GraspRequest:
    """What to propose grasps for.

    ``solid`` is the watertight mesh, ``hulls`` the convex collision vertices (each ``(V, 3)``), both in the object frame in
    metres. ``focus_points_m`` ``(P, 3)`` are the selected points: proposals should be denser around them.
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


@dataclass(frozen=True)
class GraspProposals:
    """Grasps in the grasp frame (+Z approach, X closing, origin at the gripper's base).

    ``gripper_to_object (N, 4, 4)``, ``width_m (N,)`` distance of the two contacts along X, ``depth_m (N,)`` fingertip
    centre along +Z, ``score (N,)`` in [0, 1].
    """

    gripper_to_object: np.ndarray
    width_m: np.ndarray
    depth_m: np.ndarray
    score: np.ndarray

    def __len__(self) -> int:
        return len(self.gripper_to_object)

    def take(self, index: np.ndarray) -> GraspProposals:
        """Return the proposals at ``index``."""
        return GraspProposals(
            self.gripper_to_object[index], self.width_m[index], self.depth_m[index], self.score[index]
        )


class Grasper(Protocol):
    """Propose grasps; raises BackendError where it cannot."""

    name: str
    model: str | None

    def propose(self, request: GraspRequest) -> GraspProposals:
        """Return up to ``max_proposals`` grasps, not yet filtered for collision or proven."""
        ...
