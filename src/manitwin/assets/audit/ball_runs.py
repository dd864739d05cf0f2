"""Ball drop test: whether collision shapes leave the visible opening of a vessel open, in physics engines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.poses import rotation_between

_UPWARD = 0.99
"""Least cosine between opening and up direction: gravity empties a hollow that opens to the side."""
_MOST_FACES = 200_000
"""Largest mesh that is searched for an opening; for larger scans, the search costs more than all other rules."""


@dataclass(frozen=True)
class BallDrops:
    """The visible opening, with up along +Z, and whether a ball stays inside in each engine.

    ``refused`` has the error message of each engine that failed.
    """

    opening: Opening | None
    inside: dict[str, bool]
    refused: dict[str, str]


def drop_balls(measured: MeasuredAsset) -> BallDrops:
    """Drop a ball into the opening of an asset, if it has one, in each requested engine."""
    visual = measured.visual
    if visual is None or not len(measured.shapes) or len(visual.faces) > _MOST_FACES:
        return BallDrops(None, {}, {})
    turn = rotation_between(measured.up, np.array([0.0, 0, 1]))
    seen = trimesh.Trimesh(np.asarray(visual.vertices) @ turn.T, visual.faces, process=False)
    opening = find_opening(seen)
    if opening is None or opening.axis[2] < _UPWARD:
        return BallDrops(None, {}, {})
    kept = [np.asarray(measured.asset.collision[index].vertices, float) @ turn.T for index in measured.shapes.kept]
    inside: dict[str, bool] = {}
    refused: dict[str, str] = {}
    for engine in measured.engines:
        try:
            inside[engine] = _ENGINES[engine](kept, opening)
        except (RuntimeError, ValueError, FloatingPointError) as error:
            refused[engine] = " ".join(str(error).split())[:200] or type(error).__name__
    return BallDrops(opening, inside, refused)


def _mujoco(hulls: Sequence[np.ndarray], opening: Opening) -> bool:
    from manitwin.physics.mujoco.settle import ball_stays_inside_in_mujoco

    return ball_stays_inside_in_mujoco(hulls, opening)


def _sapien(hulls: Sequence[np.ndarray], opening: Opening) -> bool:
    from manitwin.physics.sapien.settle import ball_stays_inside

    return ball_stays_inside(hulls, opening)


def _pybullet(hulls: Sequence[np.ndarray], opening: Opening) -> bool:
    from manitwin.assets.audit.pybullet_run import ball_stays_inside_in_pybullet

    return ball_stays_inside_in_pybullet(hulls, opening)


_ENGINES: dict[str, Callable[[Sequence[np.ndarray], Opening], bool]] = {
    "mujoco": _mujoco, "sapien": _sapien, "pybullet": _pybullet
}  # fmt: skip
