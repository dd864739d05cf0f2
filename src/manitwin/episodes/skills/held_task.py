"""What a skill asks to be done with a thing in the hand (or with the closed hand): paths, grasps, guards, endings."""

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
    """What a skill sees once all has come to rest: where things are, their frames, the fixtures, and the hand.

    ``openings`` and ``places_m`` are those of the goal. ``fingers`` are the names of the finger links; ``fingertips_m (N, 3)``
    the corners of the closed fingers in the grasp frame, ``tip_depth_m`` how far along its Z the middle of the pads is.
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
class Guard:
    """A guarded move: from knot ``first`` on, until what is watched presses with ``stop_n``.

    A touch is expected at knot ``touches``. It goes at ``speed_m_s`` at most and, where a touch is expected, creeps there; or as
    a blow: as fast as ``duration_s`` says, fastest at the end of the path (``beyond`` > 1, see ``path_timing``), and yielding
    once it touches.
    """

    first: int
    stop_n: float
    speed_m_s: float | None = None
    duration_s: float = 0.5
    beyond: float = 1.0
    touches: int = 0

    @property
    def is_blow(self) -> bool:
        """Whether it goes as fast as it can where it touches."""
        return self.beyond > 1


@dataclass(frozen=True)
class Regulated:
    """A move under force: from knot ``first`` on, as far as a guard came, while what is watched presses with ``force_n``.

    The way is that of the poses' places alone, from where the guard has stopped; ``normal (3,)``, out of the surface, world
    frame, is the direction in which the hand yields or follows; ``speed_m_s`` is the mean along it.
    """

    first: int
    force_n: float
    normal: np.ndarray
    speed_m_s: float


@dataclass(frozen=True)
class HeldTask:
    """One skill's work: ``paths`` are alternatives, of which the first that can be planned is taken, ``otherwise`` more of them.

    ``rank`` orders grasps, the least first; None: its fingers block the function. ``empty``: the closed hand itself moves, and
    nothing is grasped. ``as_hulls``: the target is carried as its hulls, and may go into the objects that it ``enters``. The
    path takes ``duration_s``, is not taken where the joints need more than ``longest_s``, and is measured and planned anew
    ``measured`` times. After ``hold_s`` there the target is let go, or kept in the hand, which goes back along the path, or put
    back where it was. One that ``rises`` goes straight up first, and from there to the path's beginning; one that ``comes_out``
    ends where it began, and does not go back. ``level_rad``: the target is tilted by no more on its way to the path. ``steady``:
    what turns in the hand on the path spoils it. ``watch`` makes what latches events, and what a guard asks for the force.
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
    guard: Guard | None = None
    regulated: Regulated | None = None
    rises: bool = False
    comes_out: bool = False
    level_rad: float | None = None
    otherwise: tuple[HeldPath, ...] = ()
    steady: bool = False
    watch: Callable[[RobotWorld], EventWatch] | None = None
