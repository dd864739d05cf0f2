"""Skill ``lift``: grasp an object and hold it up."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.skills.held_skill import HeldSkill
from manitwin.episodes.skills.held_task import HeldScene, HeldTask
from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

LEAST_M = 0.1  # height that the goal requires
HEIGHTS_M = (0.13, 0.16, 0.19)  # above the required height, because the arm sags and objects rotate in the hand
# lateral alternatives if there is no room straight above
ASIDE_M = ((0.0, 0.0), (-0.08, 0.0), (0.0, 0.08), (0.0, -0.08), (0.08, 0.0))
HELD_S, UP_S = 0.5, 1.0


class Lift(HeldSkill):
    """Hold the target at least 10 cm above its start, in its initial orientation."""

    name, predicate = "lift", "lifted"

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept anything: the grasps decide."""
        return True

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the target is in the hand, at least 10 cm above its start."""
        return Goal((Literal("lifted", target.name, None, LEAST_M),))

    def task(self, scene: HeldScene) -> HeldTask:
        """Return paths up: straight above the start, or slightly to the side."""
        start = scene.target.object_to_world
        ways = [
            HeldPath(np.array([transform(None, np.array([*aside, height])) @ start for height in HEIGHTS_M]))
            for aside in ASIDE_M
        ]
        return HeldTask(tuple(ways), duration_s=UP_S, measured=1, hold_s=HELD_S, ending="keep")
