"""JNT rules: validity of joint axes and limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.joints import ABOUT_AN_AXIS, LIMITED, TURNS, DeclaredJoint

_NO_LENGTH = 1e-9
_NOT_OF_LENGTH_ONE = 1e-3
TWO_TURNS, MOST_DEGREES = 4 * math.pi, 720.0
"""Robot wrists turn by up to two turns in each direction. A limit above 4 pi, and up to 720, was meant in degrees."""
_MULTIPLE_OF_PI = 1e-3
"""In multiples of pi: a limit this close to a whole multiple is a wide range in radians, not in degrees."""
DEGREES_FOR_RADIANS = math.radians(math.pi)
"""Half a turn in radians that MuJoCo read as degrees."""
_RADIAN_FRACTIONS = tuple(math.radians(math.pi * part) for part in (1.0, 0.75, 2 / 3, 0.5, 1 / 3, 0.25))
_NEAR_FRACTION = 5e-3
"""Relative difference up to which a limit counts as one of these fractions of pi."""
MOST_NAMED = 3


def no_axis(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report joints whose axis has no direction."""
    yield from _joints_complaint(measured, _lacks_direction, lambda j: f"joint {j.name!r} has the axis {_axis_text(j)}")


def _lacks_direction(joint: DeclaredJoint) -> bool:
    if joint.kind not in ABOUT_AN_AXIS or joint.axis is None:
        return False
    return not _length(joint) > _NO_LENGTH  # also true for NaN


def _length(joint: DeclaredJoint) -> float:
    return 1.0 if joint.axis is None else float(np.linalg.norm(joint.axis))


def axis_not_of_length_one(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report axes that are not of unit length, which some engines normalize and others do not."""

    def applies(joint: DeclaredJoint) -> bool:
        if joint.kind not in ABOUT_AN_AXIS or joint.axis is None or _lacks_direction(joint):
            return False
        return abs(_length(joint) - 1) > _NOT_OF_LENGTH_ONE

    yield from _joints_complaint(
        measured, applies, lambda j: f"the axis of joint {j.name!r} has the length {_length(j):.4g}"
    )


def limits_inverted(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report joints whose lower limit is above the upper one, or not a number."""

    def applies(joint: DeclaredJoint) -> bool:
        if joint.kind == "continuous" or joint.lower is None or joint.upper is None:
            return False
        return joint.kind in ABOUT_AN_AXIS and not joint.lower <= joint.upper

    yield from _joints_complaint(
        measured, applies, lambda j: f"the limits of joint {j.name!r} are {j.lower:g} and {j.upper:g}"
    )


def limits_in_degrees(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report limits that look like degrees in a format with radians, or like radians in a format with degrees."""
    in_degrees, radians = measured.asset.format in ("mjcf", "usd"), measured.asset.format != "usd"

    def applies(joint: DeclaredJoint) -> bool:
        if joint.kind not in TURNS or joint.lower is None or joint.upper is None:
            return False
        ends = [abs(end) for end in (joint.lower, joint.upper) if end]
        if in_degrees and joint.upper - joint.lower <= 2 * DEGREES_FOR_RADIANS * (1 + _NEAR_FRACTION):
            return bool(ends) and all(_is_a_fraction(end) for end in ends)
        return radians and any(
            TWO_TURNS + _MULTIPLE_OF_PI < end <= MOST_DEGREES and not _is_multiple_of_pi(end) for end in ends
        )

    def said(joint: DeclaredJoint) -> str:
        lower, upper = (float(joint.lower or 0), float(joint.upper or 0))
        if in_degrees and max(abs(lower), abs(upper)) < 1:
            degrees = f"{math.degrees(lower):.4g} to {math.degrees(upper):.4g} degrees"
            return f"joint {joint.name!r} turns from {degrees}, which looks like radians"
        return f"joint {joint.name!r} turns from {lower:g} to {upper:g} rad, which looks like degrees"

    yield from _joints_complaint(measured, applies, said)


def _is_a_fraction(end: float) -> bool:
    return any(abs(end / fraction - 1) < _NEAR_FRACTION for fraction in _RADIAN_FRACTIONS)


def _is_multiple_of_pi(end: float) -> bool:
    return abs(end / math.pi - round(end / math.pi)) <= _MULTIPLE_OF_PI


def limits_missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report URDF joints without the limits that their type requires."""
    if measured.asset.format not in ("urdf", "embodiedgen"):
        return

    def applies(joint: DeclaredJoint) -> bool:
        return joint.kind in LIMITED and joint.lower is None

    yield from _joints_complaint(measured, applies, lambda j: f"joint {j.name!r} is {j.kind} and has no <limit>")


def cannot_move(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report joints with equal limits."""

    def applies(joint: DeclaredJoint) -> bool:
        return (
            joint.kind in ABOUT_AN_AXIS
            and joint.kind != "continuous"
            and joint.lower is not None
            and joint.lower == joint.upper
        )

    yield from _joints_complaint(
        measured, applies, lambda j: f"both limits of joint {j.name!r} are {j.lower:g}: it cannot move"
    )


def mimics_missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report joints that mimic a joint which does not exist."""
    names = {joint.name for joint in measured.asset.joints}

    def applies(joint: DeclaredJoint) -> bool:
        return joint.follows is not None and joint.follows not in names

    yield from _joints_complaint(
        measured, applies, lambda j: f"joint {j.name!r} mimics {j.follows!r}, which the file does not have"
    )


def _joints_complaint(
    measured: MeasuredAsset, applies: Callable[[DeclaredJoint], bool], said: Callable[[DeclaredJoint], str]
) -> Iterator[Complaint]:
    """Report all joints for which ``applies`` is true in one complaint, with the text of ``said`` for the first few."""
    found: Sequence[DeclaredJoint] = [joint for joint in measured.asset.joints if applies(joint)]
    if found:
        more = f"; and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
        named = "; ".join(said(joint) for joint in found[:MOST_NAMED])
        yield Complaint(f"{named}{more}", values={"joints": [joint.name for joint in found[:50]]})


def _axis_text(joint: DeclaredJoint) -> str:
    return " ".join(f"{value:g}" for value in (joint.axis if joint.axis is not None else ()))


RULES = (
    Rule(
        "JNT001",
        "joint-axis-zero",
        "error",
        why="A joint turns about its axis or slides along it. One of no length, or of no three numbers, is refused by MuJoCo and"
        " by urdfdom, and divides by zero elsewhere.",
        remedy="Give the axis a direction.",
        check=no_axis,
    ),
    Rule(
        "JNT002",
        "joint-limits-inverted",
        "error",
        why="No position lies between a lower limit that is above the upper one. PyBullet takes it for a joint without limits,"
        " MuJoCo refuses it, and planners find no path.",
        remedy="Exchange the two numbers; a joint without limits is `continuous` in URDF.",
        check=limits_inverted,
    ),
    Rule(
        "JNT003",
        "joint-limits-in-degrees",
        "warning",
        why="Limits are radians in URDF and SDF. A number beyond two turns that is no whole multiple of pi is most often an"
        " angle in degrees: the joint then has no limit that it could meet. USD has degrees, and so has MJCF unless its compiler"
        " says radian; limits that are simple parts of pi are then 57 times too narrow.",
        remedy='Write radians, in USD degrees; in MJCF say `<compiler angle="radian"/>` where they are radians.',
        check=limits_in_degrees,
    ),
    Rule(
        "JNT004",
        "joint-limits-missing",
        "warning",
        why="The URDF specification asks revolute and prismatic joints for a <limit>. urdfdom, and so ROS and Gazebo, refuses"
        " the file without one; other loaders take no limit or a range of nothing.",
        remedy="Give the joint a <limit>, or make it continuous.",
        check=limits_missing,
    ),
    Rule(
        "JNT005",
        "joint-cannot-move",
        "warning",
        why="Where both limits are one number the joint cannot move by the letter of the format. PyBullet locks it, MuJoCo"
        " leaves it without limits.",
        remedy="Give it a range, or make it fixed.",
        check=cannot_move,
    ),
    Rule(
        "JNT006",
        "joint-mimics-none",
        "error",
        why="A joint that copies one which the file does not have is refused by some loaders, and moves freely in others.",
        remedy="Name a joint of the file.",
        check=mimics_missing,
    ),
    Rule(
        "JNT007",
        "joint-axis-not-unit",
        "note",
        why="MuJoCo, SAPIEN and urdfdom's users normalize an axis, PyBullet does not: positions are scaled by its length there.",
        remedy="Divide the axis by its length.",
        check=axis_not_of_length_one,
    ),
)
