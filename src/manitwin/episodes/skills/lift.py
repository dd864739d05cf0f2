"""``lift``: take a thing and hold it up."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

LEAST_M = 0.1  # what the goal asks for
HEIGHTS_M = (0.13, 0.16, 0.19)  # the arm sags, and things turn in the hand: more than what is asked for
ASIDE_M = ((0.0, 0.0), (-0.08, 0.0), (0.0, 0.08), (0.0, -0.08), (0.08, 0.0))  # where there is no room straight above
HELD_S, UP_S = 0.5, 1.0


class Lift(HeldSkill):
    """Hold the target up by 10 cm or more, turned as it lay."""

    name, predicate = "lift", "lifted"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept anything: grasps decide."""
        return True

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return: in the hand, higher by 10 cm than at the beginning."""
        return Goal((Literal("lifted", target.name, None, LEAST_M),))

    def task(self, scene: HeldScene) -> HeldTask:
        """Return ways up: straight above where it lay, or a little aside."""
        start = scene.target.object_to_world
        ways = [
            HeldPath(np.array([transform(None, np.array([*aside, height])) @ start for height in HEIGHTS_M]))
            for aside in ASIDE_M
        ]
        return HeldTask(tuple(ways), duration_s=UP_S, measured=1, hold_s=HELD_S, ending="keep")
