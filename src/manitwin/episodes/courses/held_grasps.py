"""Selection and order of grasps for a held path: they must leave the function free and carry the object's weight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from manitwin.episodes.courses.course import split_by_quality
from manitwin.episodes.grasp_stability import has_narrow_contact, stable_along_path
from manitwin.episodes.planning.problem import Grasp, PlanFailure
from manitwin.episodes.skills.held_task import HeldTask
from manitwin.geometry.rigid_body import RigidBody
from manitwin.robots.grippers.gripper import Gripper


def grasps_of_task(
    tiers: Sequence[Sequence[Grasp]], task: HeldTask, body: RigidBody, gripper: Gripper
) -> tuple[tuple[Grasp, ...], Counter[PlanFailure]]:
    """Return the usable grasps of all tiers, the best of each tier first, and the number of rejected grasps by reason.

    For a ``steady`` task, grasps in which the weight would turn the object along the path are rejected, and grasps that carry
    it by a line contact rank before those that need a face contact.
    """
    ranked = [grasp for tier in tiers for grasp in _ranked(tier, task, body, gripper)]
    left_out = Counter[PlanFailure]({"blocks_function": sum(map(len, tiers)) - len(ranked)})
    if task.steady:
        steady = stable_along_path(ranked, body, [path.poses for path in task.paths], gripper)
        left_out["weight_not_borne"] = len(ranked) - len(steady)
        ranked = steady
    return tuple(ranked), +left_out


def _ranked(grasps: Sequence[Grasp], task: HeldTask, body: RigidBody, gripper: Gripper) -> list[Grasp]:
    """Return the grasps that leave the function free, best first, separately for the first three quarters and the rest.

    Among equal ranks, grasps with broad pad contact come first.
    """
    narrow = has_narrow_contact(grasps, body, gripper)
    ranks = [(task.rank(grasp), late, grasp) for grasp, late in zip(grasps, narrow, strict=True)]
    free = [(rank, late, grasp) for rank, late, grasp in ranks if rank is not None]
    return [grasp for part in split_by_quality(free) for *_, grasp in sorted(part, key=lambda each: each[:2])]
