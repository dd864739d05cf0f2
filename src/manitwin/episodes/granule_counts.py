"""Numbers of granules in each object of an episode, at the start and in every row of its recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from manitwin.episodes.goals.functional import is_granule_inside, is_in_cavity
from manitwin.episodes.goals.world_state import Granules, ObjectState
from manitwin.episodes.recording import Recording
from manitwin.geometry.cavity import Opening
from manitwin.geometry.poses import rotation_from_quaternion_wxyz
from manitwin.geometry.rigid_body import PlacedObject


def count_granules(
    objects: Sequence[PlacedObject],
    object_to_world: Sequence[np.ndarray],
    openings: Mapping[str, Opening],
    granules: Granules,
) -> dict[str, int]:
    """Return the number of granules in each object at its pose ``(4, 4)``, by name."""
    counts = {}
    for placed, pose in zip(objects, object_to_world, strict=True):
        vessel = ObjectState(placed.body, pose, pose, True, openings.get(placed.name))
        counts[placed.name] = int(is_granule_inside(vessel, granules).sum())
    return counts


def with_granule_counts(
    recording: Recording, objects: Sequence[PlacedObject], openings: Mapping[str, Opening], radius_m: float
) -> Recording:
    """Return the recording with the number of granules in each object in every row."""
    assert recording.granule_positions_m is not None
    middles = recording.granule_positions_m.astype(float)
    held = np.zeros((len(middles), len(objects)), np.int16)
    for number, placed in enumerate(objects):
        if (opening := openings.get(placed.name)) is None:
            continue
        turns = rotation_from_quaternion_wxyz(recording.object_quaternions_wxyz[:, number].astype(float))
        from_origin = middles - recording.object_positions_m[:, number, None].astype(float)
        inside = is_in_cavity(opening, np.concatenate(placed.body.hulls), from_origin @ turns, radius_m)
        held[:, number] = inside.sum(1)
    return replace(recording, granules_in_objects=held)
