"""RUN rules on moving parts: overlaps at loading, and collisions over the joint range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.linkage.linkage import Linkage
from manitwin.assets.audit.linkage.overlaps import find_overlaps
from manitwin.assets.audit.linkage.read import read_linkage
from manitwin.assets.audit.linkage.sweeps import JointSweep, sweep_joints
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules.joints import limits_in_degrees
from manitwin.errors import AssetError

DEEP_M, DEEP_SHARE = 0.003, 0.03
"""Tolerated penetration in metres, and as share of the longest side of the smaller part, for soft contacts and skins."""
STARTS_INSIDE, FREED = 0.25, 0.5
"""Least share of a part inside its parent that counts as overlap, and the fraction of it that may remain.

Some joint position must free the part down to that fraction, which a housing does not.
"""
PASSES_THROUGH = 0.35
"""Share of a part's surface that passes through its parent; folded robot limbs have less."""
_MOST_NAMED = 3
_SELF_COLLIDING = ("mujoco", "sapien")
"""PyBullet lets links of a URDF collide with each other only on request."""


@dataclass(frozen=True)
class _LinkageResult:
    linkage: Linkage | None
    why_not: str = ""


def _linkage(measured: MeasuredAsset) -> _LinkageResult:
    asset = measured.asset
    if not measured.engines or asset.soft or not (asset.joints or asset.format == "mjcf"):
        return _LinkageResult(None)
    try:
        return _LinkageResult(read_linkage(asset.path, asset.format, measured.root))
    except AssetError as error:
        return _LinkageResult(None, " ".join(str(error).split())[:200])


def _all_sweeps(measured: MeasuredAsset) -> list[JointSweep]:
    linkage = measured.measure_once(_linkage).linkage
    return [] if linkage is None else sweep_joints(linkage)


def linkage_error(measured: MeasuredAsset) -> str:
    """Return why the parts of the asset were not checked; empty if they were, or if there are none."""
    return measured.measure_once(_linkage).why_not


def starts_overlapping(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report parts that overlap each other or the ground at loading."""
    linkage = measured.measure_once(_linkage).linkage
    if linkage is None:
        return
    found = []
    if linkage.overlaps is not None or any(engine in _SELF_COLLIDING for engine in measured.engines):
        sizes = {part.name: _longest_m(part.shapes) for part in linkage.parts if part.shapes}
        for each in find_overlaps(linkage):
            least_m = min(sizes.get(name, np.inf) for name in (each.one, each.other))
            if each.depth_m > max(DEEP_M, DEEP_SHARE * (least_m if np.isfinite(least_m) else 0.0)):
                found.append((each.depth_m, f"{each.one!r} lies {1000 * each.depth_m:.3g} mm in {_named(each.other)}"))
    for entry in measured.measure_once(_all_sweeps):
        if _starts_inside(entry):
            joint = entry.joint
            moved, holder = linkage.parts[joint.child].name, linkage.parts[joint.parent].name
            found.append(
                (0.0, f"{entry.inside:.0%} of {moved!r} lies in {holder!r}, which joint {joint.name!r} moves it out of")
            )
    if found:
        found.sort(key=lambda each: -each[0])
        more = f"; and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
        yield Complaint(
            f"as it is loaded {'; '.join(said for _, said in found[:_MOST_NAMED])}{more}",
            values={"overlaps": [said for _, said in found[:50]]},
        )


def passes_through(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report joints that drive a part through its parent."""
    linkage = measured.measure_once(_linkage).linkage
    in_degrees = {name for said in measured.complaints(limits_in_degrees) for name in (said.values or {})["joints"]}
    found = [
        entry
        for entry in measured.measure_once(_all_sweeps)
        if entry.joint.name not in in_degrees
        and entry.crossing >= PASSES_THROUGH
        and not entry.is_enclosed
        and not _starts_inside(entry)
    ]
    if linkage is not None and found:
        named = "; ".join(
            f"joint {entry.joint.name!r} drives {entry.crossing:.0%} of {linkage.parts[entry.joint.child].name!r} through"
            f" {linkage.parts[entry.joint.parent].name!r}"
            for entry in found[:_MOST_NAMED]
        )
        more = f"; and {len(found) - _MOST_NAMED} more" if len(found) > _MOST_NAMED else ""
        yield Complaint(
            f"within its range {named}{more}",
            values={
                "joints": [entry.joint.name for entry in found[:50]],
                "shares": [entry.crossing for entry in found[:50]],
            },
        )


def _starts_inside(entry: JointSweep) -> bool:
    return entry.inside >= STARTS_INSIDE and entry.least_inside <= FREED * entry.inside


def _longest_m(shapes: tuple[np.ndarray, ...]) -> float:
    return float(np.ptp(np.concatenate(shapes), axis=0).max())


def _named(other: str) -> str:
    return other if other.startswith("the ") else repr(other)


RULES = (
    Rule(
        "RUN009",
        "starts-overlapping",
        "warning",
        why="Parts that lie in each other, or in the ground, as the asset is loaded are thrown apart in the first steps; where"
        " engines skip the pair, for a joint joins it, the part starts in a place that it could not be in. Of an MJCF these are"
        " MuJoCo's own contacts, with the file's exclusions, of the initial position or the best keyframe.",
        remedy="Look at the origin of the joint; move the initial position or the ground, or exclude pairs that are meant to"
        " overlap.",
        check=starts_overlapping,
    ),
    Rule(
        "RUN010",
        "passes-through",
        "warning",
        why="Engines skip contacts between a part and what holds it: a drawer whose axis points the wrong way, or whose limits"
        " are exchanged with another's, slides through the back of its cabinet without a word, and MuJoCo jams it where the"
        " cabinet stands fast.",
        remedy="Turn the axis round, or narrow the limits; where the collision is one hull of a hollow thing, decompose it.",
        check=passes_through,
    ),
)
