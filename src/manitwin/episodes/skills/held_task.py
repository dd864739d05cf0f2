"""Task of a held-object skill: paths of the object or the closed hand, ranking of grasps, guarded moves, and endings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from manitwin.episodes.events import EventWatch
from manitwin.episodes.fixtures import Fixture
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.problem import Grasp
from manitwin.geometry.cavity import Opening
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.scenes.layouts.twin_frames import TwinFrame

MEASURED_TIMES = 4


@dataclass(frozen=True)
class HeldScene:
    """Scene for a skill once all objects are at rest: poses, frames, fixtures, and the hand.

    ``openings`` and ``places_m`` are those of the goal. ``fingers`` are the names of the finger links;
    ``fingertips_m (N, 3)`` the vertices of the closed fingertips in the grasp frame, ``tip_depth_m`` the coordinate of the
    pads' centre along its Z.
    """

    target: PlacedObject
    objects: Mapping[str, PlacedObject]
    partner: PlacedObject | None
    frames: Mapping[str, tuple[TwinFrame, ...]]
    openings: Mapping[str, Opening]
    places_m: Mapping[str, np.ndarray]
    fixtures: tuple[Fixture, ...]
    fingers: frozenset[str]
    fingertips_m: np.ndarray
    tip_depth_m: float
    rng: np.random.Generator


@dataclass(frozen=True)
class GuardedMove:
    """Guarded move: from knot ``first`` on, until the watched force reaches ``stop_n``.

    Contact is expected at knot ``touches``. The speed is at most ``speed_m_s``, and the move creeps at the expected contact.
    A blow instead has the duration ``duration_s``, is fastest at the end of the path (``beyond`` > 1, see ``path_timing``),
    and yields on contact.
    """

    first: int
    stop_n: float
    speed_m_s: float | None = None
    duration_s: float = 0.5
    beyond: float = 1.0
    touches: int = 0

    @property
    def is_blow(self) -> bool:
        """Whether the move is as fast as possible at contact."""
        return self.beyond > 1


@dataclass(frozen=True)
class ForceControlledMove:
    """Force-controlled move: from knot ``first`` on, from where the guard stopped, with the watched force kept at ``force_n``.

    The path uses only the positions of the poses, relative to where the guard stopped. ``normal (3,)``, out of the surface in
    the world frame, is the direction of compliance; ``speed_m_s`` is the mean speed along the path.
    """

    first: int
    force_n: float
    normal: np.ndarray
    speed_m_s: float


@dataclass(frozen=True)
class HeldTask:
    """Task of one skill. ``paths`` are alternatives, of which the first feasible one is used, ``otherwise`` are further ones.

    ``rank`` orders grasps, smallest first; None: the fingers block the function. ``empty``: the closed hand moves, and
    nothing is grasped. ``as_hulls``: the target is carried as its hulls, and may enter the objects that it ``enters``.

    The path takes ``duration_s``, is rejected if the joint limits require more than ``longest_s``, and is replanned from
    measurements ``measured`` times. After ``hold_s`` at its end the target is released ("let_go"), kept in the hand, which
    goes back along the path ("keep"), or also returned to its place ("put_back"). ``rises``: it first goes straight up and
    from there to the path's start. ``comes_out``: the path ends where it started, so that there is no way back.
    ``level_rad``: largest tilt of the target on the way to the path. ``steady``: rotation of the target in the hand during
    the path would spoil the result. ``watch`` creates the watch that records events and measures the force for a guard.
    """

    paths: tuple[HeldPath, ...]
    rank: Callable[[Grasp], float | None] = lambda _: 0.0
    empty: bool = False
    as_hulls: bool = False
    enters: frozenset[str] = frozenset()
    duration_s: float = 3.0
    longest_s: float = 6.0
    measured: int = MEASURED_TIMES
    hold_s: float = 0.0
    ending: Literal["let_go", "keep", "put_back"] = "let_go"
    guard: GuardedMove | None = None
    regulated: ForceControlledMove | None = None
    rises: bool = False
    comes_out: bool = False
    level_rad: float | None = None
    otherwise: tuple[HeldPath, ...] = ()
    steady: bool = False
    watch: Callable[[RobotWorld], EventWatch] | None = None
