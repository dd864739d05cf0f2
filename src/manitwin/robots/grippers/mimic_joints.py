"""Mimic joints of a hand: ``<mimic>`` of a URDF (http://wiki.ros.org/urdf/XML/joint)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.robots.links import Link
from manitwin.robots.urdf import UrdfTree

FOLLOWS_WITHIN_RAD = 0.005
"""Tolerance, because positions in gripper files are rounded to two or three digits."""


@dataclass(frozen=True)
class MimicJoint:
    """Mimic joint at ``ratio`` times the position of its leader, plus ``offset``."""

    leader: str
    ratio: float
    offset: float


def read_mimic_joints(tree: UrdfTree) -> dict[str, MimicJoint]:
    """Return the mimic joints of a checked URDF by name, each resolved to a leader that is not a mimic joint itself.

    Raises the tree's error if a leader does not exist or if joints mimic each other in a cycle.
    """
    given = {
        name: MimicJoint(mimic.get("joint", ""), float(mimic.get("multiplier", "1")), float(mimic.get("offset", "0")))
        for name, joint in tree.joints.items()
        if joint.get("type") != "fixed" and (mimic := joint.find("mimic")) is not None
    }
    for coupling in given.values():
        tree.joint(coupling.leader)
    return {name: _resolve_leader(tree, given, name) for name in given}


def _resolve_leader(tree: UrdfTree, given: dict[str, MimicJoint], name: str) -> MimicJoint:
    whole, seen = given[name], {name}
    while whole.leader in given:
        if whole.leader in seen:
            raise tree.make_error(f"joint {name!r}", "mimics itself by way of others", "let one of them lead")
        seen.add(whole.leader)
        above = given[whole.leader]
        whole = MimicJoint(above.leader, whole.ratio * above.ratio, whole.ratio * above.offset + whole.offset)
    return whole


def with_mimic_positions(
    named: tuple[str, ...], positions_rad: np.ndarray, links: tuple[Link, ...], couplings: dict[str, MimicJoint]
) -> tuple[tuple[str, ...], np.ndarray]:
    """Return all movable joints, the ``named`` ones first, and their positions ``(K, J)``, given those of the named ones.

    ``positions_rad (K, N)`` are those of the named joints. A mimic joint that is not named follows its leader, clipped to its
    limits. Raises ValueError if a mimic joint is named with a different position, or if a leader is not named.
    """
    left_out = [link.joint for link in links if link.joint in couplings and link.joint not in named]
    limits = {link.joint: link.limits for link in links}
    columns = dict(zip(named, positions_rad.T, strict=True))
    for name in [*left_out, *(name for name in named if name in couplings)]:
        coupling = couplings[name]
        if coupling.leader not in named:
            raise ValueError(f"joints: {coupling.leader!r} is not named, which {name!r} follows; name it")
        follows = np.clip(coupling.ratio * columns[coupling.leader] + coupling.offset, *limits[name])
        off = np.abs(columns.setdefault(name, follows) - follows)
        if off.max(initial=0.0) > FOLLOWS_WITHIN_RAD:
            row = int(off.argmax())
            raise ValueError(
                f"joints_rad: row {row} has {name!r} at {columns[name][row]:g}, its <mimic> puts it at {follows[row]:.4g}"
                f" ({coupling.ratio:g} times {coupling.leader!r} plus {coupling.offset:g}, within its limits); leave"
                f" {name!r} out of joints, or correct the row"
            )
    joints = (*named, *left_out)
    return joints, np.stack([columns[name] for name in joints], axis=-1)
