"""Drop test of a twin with free joints in MuJoCo: from its present pose, and from both ends of the joint ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.errors import TwinError
from manitwin.geometry.articulation import ArticulatedBody, ArticulatedJoint, link_motions
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform, transform_points
from manitwin.twin.loaded_twin import Twin

DROP_M, SECONDS = 0.005, 4.0
BEYOND_RAD, BEYOND_M = 0.05, 0.003
"""How far past its limit a joint may end: MuJoCo's limits are soft, but the weight of a link pushes them by less."""


@dataclass(frozen=True)
class JointRuns:
    """The worst of the runs: ``lowest_m`` above the plane, and descriptions of joints that end beyond a limit.

    ``refused`` has the error message of the engine if it does not run.
    """

    lowest_m: float = 0.0
    beyond: tuple[str, ...] = ()
    refused: str = ""


def run_free_joints(measured: MeasuredAsset) -> JointRuns:
    """Release an audited twin in its first placement with free joints."""
    from manitwin.physics.mujoco.articulated import settle_articulated

    path, record = measured.asset.path, measured.record
    assert record is not None and record.placements
    first = record.placements[0]
    pose = transform(rotation_from_quaternion_wxyz(np.array(first.quaternion_wxyz)), np.array(first.position_m))
    lowest_m, beyond = 0.0, dict[str, None]()
    try:
        body = Twin(path.parent if path.is_file() else path).articulated_body()
        for positions in _starts(body):
            at = pose.copy()
            at[2, 3] -= min(0.0, _lowest_m(body, pose, positions))  # an open drawer may reach deeper than a closed one
            rest = settle_articulated(body, at, drop_m=DROP_M, seconds=SECONDS, positions=positions)
            low = _lowest_m(body, rest.root_to_plane, rest.positions)
            lowest_m = low if abs(low) > abs(lowest_m) else lowest_m
            beyond |= dict.fromkeys(
                _limit_violation(joint, at) for joint, at in zip(body.joints, rest.positions, strict=True)
            )
    except (TwinError, ValueError, RuntimeError, np.linalg.LinAlgError) as error:
        return JointRuns(refused=" ".join(str(error).split())[:200] or type(error).__name__)
    return JointRuns(lowest_m, tuple(words for words in beyond if words))


def _starts(body: ArticulatedBody) -> list[list[float]]:
    """Return initial joint positions: the present ones, and all joints at their lower and at their upper limits."""
    standing = [joint.stands_at for joint in body.joints]
    ends = [[joint.within(way) for joint in body.joints] for way in (-np.pi / 2, np.pi / 2)]
    return [standing, *(end for end in ends if end != standing)]


def _lowest_m(body: ArticulatedBody, root_to_plane: np.ndarray, positions: np.ndarray | list[float]) -> float:
    motions = link_motions(body.joints, list(positions))
    poses = [root_to_plane @ motion for motion in motions]
    return min(
        float(transform_points(pose, hull)[:, 2].min())
        for pose, link in zip(poses, body.links, strict=True)
        for hull in link.hulls
    )


def _limit_violation(joint: ArticulatedJoint, position: float) -> str:
    """Describe how far a joint is beyond a limit, '' if it is not."""
    way = abs(position - joint.within(position))
    if not np.isfinite(position):
        return f"joint {joint.name} at no number: the simulation blows up"
    if way <= (BEYOND_M if joint.kind == "prismatic" else BEYOND_RAD):
        return ""
    by = f"{1000 * way:.3g} mm" if joint.kind == "prismatic" else f"{np.degrees(way):.3g} degrees"
    return f"joint {joint.name} {by} beyond its limit"
