"""Usable grasps of a twin in an episode, in a random order biased towards robust ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.planning.problem import Grasp
from manitwin.geometry.poses import transform
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.twin_grippers import require_same_gripper
from manitwin.twin.grasp_table import JOINTS
from manitwin.twin.loaded_twin import Grasps, Twin

CLEARANCE_M = 0.004  # between the open pads and the object, both sides together
# A grasp of value 1 comes first e^6 = 400 times as often as one of value 0. Of 718 episodes with uniformly drawn grasps, 6 of
# the 194 with values below 2/3 failed and 1 of the 555 with higher ones. The lever of the weight, and the object's
# displacement and rotation in the trial, predict its rotation in the hand but not whether the episode fails.
SHARPNESS = 6.0


@dataclass(frozen=True)
class TargetGrasp:
    """A grasp usable in an episode; ``value`` (0 to 1) is its estimated quality.

    ``transferred``: it was verified with another parallel gripper. ``grasp_type`` is that of its grasp point.
    """

    grasp: Grasp
    grasp_type: str | None
    transferred: bool
    value: float


def usable_grasps(twin: Twin, gripper: Gripper) -> tuple[TargetGrasp, ...]:
    """Return the verified grasps that are not retired: the gripper's own, or else, for jaws, transferred ones of other jaws.

    A transferred grasp keeps its fingertip positions; objects that do not fit between the pads are omitted. Whether a grasp
    is one of jaws is read from its row, because the file of a custom gripper may not be available. Raises UsageError if the
    twin has grasps of a different gripper with this gripper's name.
    """
    require_same_gripper(gripper, [(twin.record.twin_id, _digest_of(twin, gripper.name))])
    for name in _sources(twin, gripper):
        if found := _of_gripper(twin, name, gripper):
            return found
    return ()


def shuffled(grasps: Iterable[TargetGrasp], rng: np.random.Generator) -> tuple[TargetGrasp, ...]:
    """Return the grasps in random order with a bias towards better ones (Plackett-Luce model, sampled by the Gumbel trick)."""
    chosen = tuple(grasps)
    keys = SHARPNESS * np.array([grasp.value for grasp in chosen]) + rng.gumbel(size=len(chosen))
    return tuple(chosen[i] for i in np.argsort(-keys, kind="stable"))


def _digest_of(twin: Twin, name: str) -> dict[str, str]:
    """Return the digest of the gripper file of a twin's grasps, keyed by the gripper's name; empty without such grasps."""
    summary = twin.record.grasps
    if summary is not None and summary.gripper != name:
        other = summary.other_grippers.get(name)
        summary = None if other is None else other.summary
    return {} if summary is None else {name: summary.gripper_sha256}


def _sources(twin: Twin, gripper: Gripper) -> list[str]:
    """Return the names of grippers whose grasps may be used: the requested one first, and for jaws all others."""
    summary = twin.record.grasps
    if summary is None:
        return []
    wanted, jaws = gripper.name, isinstance(gripper, ParallelGripper)
    names = [name for name in (summary.gripper, *sorted(summary.other_grippers)) if jaws or name == wanted]
    return sorted(names, key=lambda name: name != wanted)


def _of_gripper(twin: Twin, name: str, gripper: Gripper) -> tuple[TargetGrasp, ...]:
    grasps = twin.grasps(gripper=name)
    types = {point.id: point.type for point in twin.record.points.grasp} if twin.record.points else {}
    values = _values(grasps)
    jointed, jaws = isinstance(gripper, MultiFingerGripper), isinstance(gripper, ParallelGripper)
    found = []
    for i in range(len(grasps)):
        # a cup's grasps have no width, and those of a multi-finger hand have joints
        of_jaws = grasps.width_m[i] > 0 and grasps.columns[JOINTS[0]][i] is None
        fits = of_jaws and grasps.width_m[i] + CLEARANCE_M <= gripper.opening_m
        if not (fits or name == gripper.name):
            continue
        shift = transform(None, np.array([0, 0, grasps.depth_m[i] - gripper.tip_depth_m if jaws else 0.0]))
        pose, width_m = grasps.gripper_to_object[i] @ shift, float(grasps.width_m[i])
        joints = np.array([grasps.columns[column][i] for column in JOINTS], float) if jointed else None
        grasp = Grasp(grasps.columns["grasp_id"][i], pose, width_m, joints)
        point = grasps.columns["grasp_point_id"][i]
        found.append(TargetGrasp(grasp, types.get(point), name != gripper.name, values[i]))
    return tuple(found)


def _values(grasps: Grasps) -> list[float]:
    """Return the posterior mean of the success rate in perturbed trials, or the score if there were none."""
    columns = grasps.columns
    return [
        (share * trials + 1) / (trials + 2) if trials else float(score)
        for share, trials, score in zip(columns["robustness"], columns["robustness_trials"], grasps.score, strict=True)
    ]
