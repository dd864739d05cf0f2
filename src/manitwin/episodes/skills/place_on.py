"""``place_on`` and ``stack``: set an object down on another one, where a drop in physics shows that it stays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.skills.dropping import rest_after_drop
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.geometry.hull_distance import PlacedParts
from manitwin.geometry.poses import rotation_angle_rad, transform, transform_points
from manitwin.scenes.layouts.placing import draw_pose, on_plane
from manitwin.scenes.layouts.pool import Pool, PoolBody, PoolTwin
from manitwin.scenes.layouts.stacking import Level, level_end, lower

TRIED = 8
ABOVE_M = 0.001
MOST_MOVED_M, MOST_TURNED_RAD = 0.008, np.radians(6)
LEVEL_M = 0.006  # corners within this of the highest are the top: no scan of a box is level to a millimetre
BROAD_M = 0.012  # how far the middle of a top is from its edges
SPREAD_SHARE = 0.4  # of that: how far from the middle something is put


@dataclass(frozen=True)
class PlaceOn(Skill):
    """Set the target down on its partner; ``same_category``: only on its like (``stack``)."""

    name: str
    same_category: bool = False
    predicate: str = "on"
    has_partner: bool = True
    most_poses: int = 4

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept a partner with a level top, which a vessel does not have; whether the target stays there a drop shows."""
        if partner is None or partner.vessel or (self.same_category and partner.category != target.category):
            return False
        best = max(partner.poses, key=lambda pose: (pose.upright, pose.probability))
        return _top(pool.body(partner.twin_id).parts.at(best.object_to_plane)) is not None

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield the poses in which the target came to rest on its partner after a fall of a millimetre."""
        assert partner is not None
        twin = around.twin(target)
        body, goal = around.body(target), self.goal(around.objects[target], around.objects[partner])
        (low, high), top = around.parts(partner).bounds, _top(around.parts(partner))
        if top is None:
            return
        spread_m = SPREAD_SHARE * top.depth_inside(top.middle_m)
        for number in range(TRIED):
            pose = on_plane(draw_pose(twin.poses, rng), np.zeros(2), 0.0, rng.uniform(-np.pi, np.pi))
            center = transform_points(pose, body.body.center_of_mass_m[None])[0, :2]
            shift = top.middle_m - center + (0.0 if number == 0 else rng.uniform(-spread_m, spread_m, 2))
            raised = transform(translation=np.array([*shift, high[2] + 0.02])) @ pose
            lowered = lower(body, raised, [around.parts(partner)], float(low[2]))
            if lowered is None or lowered.bounds[0][2] < low[2] + ABOVE_M:
                continue
            start = transform(translation=np.array([0.0, 0, ABOVE_M])) @ lowered.pose
            rested = rest_after_drop(around, target, partner, goal, start)
            if rested is not None and _stayed(body, start, rested):
                yield rested


PLACE_ON, STACK = PlaceOn("place_on"), PlaceOn("stack", same_category=True)


def _top(base: PlacedParts) -> Level | None:
    """Return the top of a base that something may stand on: level as far as scans are, and no rim."""
    top = level_end(base, top=True, within_m=LEVEL_M)
    return top if top is not None and top.depth_inside(top.middle_m) >= BROAD_M else None


def _stayed(body: PoolBody, start: np.ndarray, end: np.ndarray) -> bool:
    """Tell whether an object rests as it was let go: what slid or toppled first is hard to set down there."""
    center = body.body.center_of_mass_m[None]
    moved_m = float(np.linalg.norm(transform_points(end, center) - transform_points(start, center)))
    return moved_m <= MOST_MOVED_M and rotation_angle_rad(end[:3, :3] @ start[:3, :3].T) <= MOST_TURNED_RAD
