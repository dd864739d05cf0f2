"""Quality checks of an articulated object set down with its joints free."""

from __future__ import annotations

import math

import numpy as np

from manitwin.engine.stage import Draft
from manitwin.geometry.articulation import ArticulatedJoint
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.pipeline.item import Item
from manitwin.pipeline.links import articulated_body, read_articulation
from manitwin.twin.record_values import Check

DROP_M, SECONDS = 0.002, 3.0
MOVED_M, TURNED_RAD = 0.01, math.radians(5.0)
"""As for a rigid body in a stable placement (``PlacementConfig``); the same limits apply to joint motion."""


def joint_checks(draft: Draft[Item]) -> list[Check]:
    """Check whether an articulated object stays in its first placement with free joints, and its joints too; empty if rigid."""
    articulation = read_articulation(draft)
    if articulation is None:
        return []
    from manitwin.physics.mujoco.articulated import settle_articulated  # imported here, as it loads the physics engine

    body, first = articulated_body(draft, articulation), draft.field("placements")[0]
    rotation = rotation_from_quaternion_wxyz(np.array(first["quaternion_wxyz"]))
    pose = transform(rotation, np.array(first["position_m"]))
    rest = settle_articulated(body, pose, drop_m=DROP_M, seconds=SECONDS)
    ways = [float(end - joint.stands_at) for end, joint in zip(rest.positions, body.joints, strict=True)]
    limits = [MOVED_M if joint.kind == "prismatic" else TURNED_RAD for joint in body.joints]
    shares = [abs(way) / limit for way, limit in zip(ways, limits, strict=True)]
    moved = [_moved(joint, way) for joint, way, share in zip(body.joints, ways, shares, strict=True) if share > 1]
    stays = rest.moved_m <= MOVED_M and rest.turned_rad <= TURNED_RAD and rest.at_rest
    still = "" if rest.at_rest else "; it still moves"
    way = f"its first link moves by {1000 * rest.moved_m:.3g} mm and {math.degrees(rest.turned_rad):.2g} degrees{still}"
    return [
        Check(
            name="rests_with_joints_free",
            passed=bool(stays),
            value=rest.moved_m,
            limit=MOVED_M,
            message="" if stays else f"{way} (MuJoCo)",
        ),
        Check(
            name="joints_stay",
            passed=not moved,
            value=float(len(moved)),
            limit=0.0,
            message=f"set down with its joints free it does not stand as it is drawn: {'; '.join(moved)}"
            if moved
            else "",
        ),
    ]


def _moved(joint: ArticulatedJoint, way: float) -> str:
    by = f"{1000 * way:.3g} mm" if joint.kind == "prismatic" else f"{math.degrees(way):.3g} degrees"
    return f"{joint.name} moves by {by}"
