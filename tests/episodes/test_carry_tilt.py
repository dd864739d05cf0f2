"""How far what is carried level was tilted on its way, as recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from brick_episodes import problem, run, standing

from manitwin.episodes.carry_tilt import carry_tilts_rad
from manitwin.episodes.planning.problem import Phase


def test_the_largest_tilt_on_the_way_is_that_of_the_recorded_states() -> None:
    other = standing("object_02", [0.05, 0.05, 0.1], 0.6, -0.3)
    asked = replace(problem(obstacles=(other,)), level=frozenset({"object_01", "object_02"}))
    facts, recording = run(asked)
    assert facts.outcome == "kept"
    assert recording is not None
    objects = (other, asked.target)
    found = carry_tilts_rad(recording, objects, asked.level)
    assert list(found) == ["object_01"], "the other one stays on the table"
    assert 0 < found["object_01"] < np.radians(5)
    turned = recording.object_quaternions_wxyz.copy()
    row = int(np.flatnonzero(recording.phase == Phase.CARRY)[3]) + 1
    turned[row, 0] = [np.cos(0.3), np.sin(0.3), 0, 0]
    assert carry_tilts_rad(replace(recording, object_quaternions_wxyz=turned), objects, asked.level)[
        "object_01"
    ] == pytest.approx(0.6, abs=1e-3)
    assert carry_tilts_rad(recording, objects, ()) == {}
