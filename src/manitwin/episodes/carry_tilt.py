"""Tilt of level-carried objects during transport, from a recording."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from manitwin.episodes.planning.level_space import tilts_rad
from manitwin.episodes.planning.problem import Phase
from manitwin.episodes.recording import Recording
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.rigid_body import PlacedObject

CARRIED_M = 0.02  # an object lifted by less has not been carried
ON_THE_WAY = (Phase.LIFT, Phase.CARRY, Phase.LOWER)


def carry_tilts_rad(recording: Recording, objects: Sequence[PlacedObject], level: Collection[str]) -> dict[str, float]:
    """Return the largest tilt (rad) from its initial orientation of each carried object named in ``level``.

    ``objects`` are the initial poses in any order; recordings order objects by name.
    """
    rows, found = np.isin(recording.phase, ON_THE_WAY), dict[str, float]()
    for number, placed in enumerate(sorted(objects, key=lambda each: each.name)):
        heights_m = recording.object_positions_m[1:, number, 2] - placed.object_to_world[2, 3]
        on_way = rows & (heights_m > CARRIED_M)
        if placed.name in level and on_way.any():
            turned = recording.object_quaternions_wxyz[1:, number][on_way]
            rotations = np.array([rotation_from_quaternion_wxyz(each) for each in turned])
            found[placed.name] = round(float(tilts_rad(rotations, placed.object_to_world[:3, :3]).max()), 4)
    return found
