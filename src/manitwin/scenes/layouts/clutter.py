"""How close objects stand: the clutter level gives the gap between them and the patch of the surface that they share."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from manitwin.robots.robot import Workspace
from manitwin.scenes.app_config import LayoutSettings
from manitwin.scenes.scene import SupportRegion

GROWTH = 1.25  # of a patch's radius when there is no room left in it


@dataclass(frozen=True)
class Clutter:
    """A level: the share of its patch that the objects' collision circles cover, and the least gap between hulls.

    Circles of things that lie overlap without their hulls touching: a share above what discs can cover is not absurd.
    """

    coverage: float
    min_gap_m: float


LEVELS = {"sparse": Clutter(0.12, 0.03), "medium": Clutter(0.3, 0.01), "dense": Clutter(0.7, 0.003)}


def clutter_of(settings: LayoutSettings) -> Clutter:
    """Return the level of the settings, with their own gap where they name one."""
    level = LEVELS[settings.clutter]
    return level if settings.min_gap_m is None else Clutter(level.coverage, settings.min_gap_m)


@dataclass
class Patch:
    """A disc on a support, from which positions are drawn; the disc grows when there is no room left in it."""

    support: SupportRegion
    workspace: Workspace | None
    center_m: np.ndarray
    radius_m: float

    @classmethod
    def draw(
        cls,
        support: SupportRegion,
        workspace: Workspace | None,
        radii_m: Iterable[float],
        level: Clutter,
        rng: np.random.Generator,
    ) -> Patch | None:
        """Return a patch for objects of these radii; None where the workspace has nothing of the support."""
        area = sum(np.pi * radius**2 for radius in radii_m) / level.coverage
        patch = cls(support, workspace, np.array(support.center_m), float("inf"))
        center = patch.position(rng)
        return None if center is None else cls(support, workspace, center, float(np.sqrt(area / np.pi)))

    def position(self, rng: np.random.Generator, tries: int = 200) -> np.ndarray | None:
        """Draw a position ``(2,)`` on the support, in the disc and the workspace; None where none is found."""
        center, half = np.array(self.support.center_m), np.array(self.support.half_extents_m)
        low, high = (
            np.maximum(center - half, self.center_m - self.radius_m),
            np.minimum(center + half, self.center_m + self.radius_m),
        )
        drawn = rng.uniform(low, high, (tries, 2))
        fine = np.linalg.norm(drawn - self.center_m, axis=1) <= self.radius_m
        fine &= in_workspace(drawn, self.workspace)
        return drawn[int(fine.argmax())] if fine.any() else None

    def grow(self) -> None:
        """Take in more of the support."""
        self.radius_m *= GROWTH


def in_workspace(points: np.ndarray, workspace: Workspace | None) -> np.ndarray:
    """Tell which points ``(N, 2)`` a robot at the origin reaches from above; all where there is no robot."""
    if workspace is None:
        return np.ones(len(points), dtype=bool)
    radius, angle = np.linalg.norm(points, axis=1), np.abs(np.arctan2(points[:, 1], points[:, 0]))
    near_enough = (radius >= workspace.min_radius_m) & (radius <= workspace.max_radius_m)
    result: np.ndarray = near_enough & (angle <= workspace.half_angle_rad)
    return result


def workspace_of(settings: LayoutSettings) -> Workspace | None:
    """Return the workspace of the settings: its numbers, else that of the named robot.

    Raises UsageError for an unknown robot, Unavailable where it needs what ``manitwin[robots]`` installs.
    """
    if settings.workspace is not None:
        near, far, half_deg = settings.workspace
        return Workspace(near, far, float(np.radians(half_deg)))
    if settings.robot is None:
        return None
    from manitwin.robots.load import load_robot

    return load_robot(settings.robot).workspace
