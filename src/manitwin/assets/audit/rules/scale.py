"""SCL rules: unit and up axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.models.annotators.prior_records import Interval

SMALLEST_M, LARGEST_M = 0.001, 2.0
"""Longest sides accepted without further evidence: from the smallest parts that robots place to the reach of an arm."""

AIR_KG_M3 = 1.2
"""At 20 degrees Celsius and sea level: an object lighter than the air in its convex hull has a wrong size or mass."""

LARGEST_UNWEIGHED_M = 10.0
"""Size limit without a declared mass: furniture, robots and vehicles are smaller; 10 cm read as metres are 10 m."""

BEYOND_USUAL = 4.0
"""Factor by which the longest side may be beyond the usual interval of the category: toys and samples are smaller."""

MIX_UPS = {1000.0: "millimetres taken for metres", 100.0: "centimetres taken for metres",
           10.0: "centimetres taken for decimetres", 25.4: "inches taken for millimetres",
           1 / 1000: "metres taken for millimetres", 1 / 100: "metres taken for centimetres",
           1 / 10: "decimetres taken for centimetres", 1 / 25.4: "millimetres taken for inches"}  # fmt: skip
"""Factors of excess size, and the unit mix-up that explains them."""

FLOOR_SHARE, CENTER_SHARE = 0.01, 0.02
"""Shares of the longest side: tolerances for standing on the plane through the origin, and for being centred above it."""


def outside_hand_size(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report objects of extreme size, or of a size that contradicts their own mass."""
    longest = measured.longest_m
    if measured.asset.static or measured.bounds is None or SMALLEST_M <= longest <= LARGEST_M:
        return
    if longest > LARGEST_M and measured.asset.inertial.mass_kg == 0:  # reported by MAS002; Bullet treats it as static
        return
    mass, hull_m3 = measured.asset.inertial.mass_kg, float(measured.hull.volumes_m3.sum())
    if len(measured.shapes):  # walls of a room enclose air
        hull_m3 = min(hull_m3, float(measured.shapes.volumes_m3.sum()))
    because = ""
    if longest > LARGEST_M:
        if mass is not None and mass > 0 and hull_m3 > 0:
            if mass >= AIR_KG_M3 * hull_m3:
                return
            because = f", and {mass:.3g} kg is less than so much air weighs"
        elif longest <= LARGEST_UNWEIGHED_M:
            return
    usual = Interval(low=0.02, typical=0.15, high=0.5) if measured.prior is None else measured.prior.longest_axis_m
    if measured.prior is not None and LARGEST_M < longest <= usual.high:  # a quilt on a bed encloses air
        return
    yield Complaint(
        f"the longest side is {_length(longest)}{because}{_mix_up(longest, usual)}", values={"longest_m": longest}
    )


def against_category(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a size that is implausible for the category; silent if the size is out of range for any object."""
    if measured.prior is None or measured.bounds is None or measured.complaints(outside_hand_size):
        return
    usual, longest = measured.prior.longest_axis_m, measured.longest_m
    if not usual.low / BEYOND_USUAL <= longest <= usual.high * BEYOND_USUAL:
        yield Complaint(
            f"the longest side is {_length(longest)}, but nearly every {measured.prior.category} has {_length(usual.low)} to"
            f" {_length(usual.high)}{_mix_up(longest, usual)}",
            values={"longest_m": longest, "usual_low_m": usual.low, "usual_high_m": usual.high},
        )


def is_of_wrong_size(measured: MeasuredAsset) -> bool:
    """Return whether the size is wrong, so that findings that depend on it would be redundant."""
    return bool(measured.complaints(outside_hand_size) or measured.complaints(against_category))


def _mix_up(longest: float, usual: Interval) -> str:
    fitting = {factor: what for factor, what in MIX_UPS.items() if usual.low <= longest / factor <= usual.high}
    if not fitting:
        return ""
    factor = min(fitting, key=lambda each: abs(np.log(longest / each / usual.typical)))
    return f"; {fitting[factor]}? ({_length(longest / factor)})"


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{1000 * metres:.3g} mm"


def up_axis(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an object that stands on the origin's plane, or opens, along another axis than the format's up axis."""
    if measured.bounds is None or measured.asset.static:  # a cupboard opens to its front
        return
    declared = measured.asset.up
    other = np.array([0.0, 0, 1]) if declared == "y" else np.array([0.0, 1, 0])
    name = "z" if declared == "y" else "y"
    evidence = []
    if _stands(measured.bounds, other) and not _stands(measured.bounds, measured.up):
        evidence.append(f"it stands on the origin's plane along +{name}")
    air = measured.free_space
    if air is not None and air.opens is not None and float(air.opens @ other) > 0.5:
        evidence.append(f"its opening looks along +{name}")
    if evidence:
        yield Complaint(f"the format's up is +{declared}, but {' and '.join(evidence)}", values={"up": declared})


def _stands(bounds: np.ndarray, up: np.ndarray) -> bool:
    """Return whether a box stands on the plane through the origin, with the origin below its centre."""
    sides = np.ptp(bounds, axis=0)
    longest = float(sides.max())
    along = int(np.abs(up).argmax())
    beside = [axis for axis in range(3) if axis != along]
    centered = np.abs(bounds.mean(0)[beside]).max() <= CENTER_SHARE * longest
    return bool(
        centered and abs(bounds[0][along]) <= FLOOR_SHARE * longest and sides[along] > 4 * FLOOR_SHARE * longest
    )


def unit_not_declared(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a missing unit for formats whose default unit is not the metre."""
    if measured.asset.unit_m is None and measured.asset.format in ("usd", "manitwin100k"):
        yield Complaint("the file declares no unit: USD's default is the centimetre, other tools take metres")


RULES = (
    Rule(
        "SCL001",
        "size-out-of-range",
        "error",
        why="Files in millimetres or centimetres load as objects of 80 m, or as dust (IsaacSim #52, IsaacLab-Arena #815: a"
        " scale of 0.007). What is longer than 2 m must weigh more than so much air; without a mass it may have 10 m.",
        remedy="Bake metres into the vertices, and declare no scale anywhere.",
        check=outside_hand_size,
    ),
    Rule(
        "SCL002",
        "size-against-category",
        "error",
        why="A mug of 1.2 m is a possible object and no mug: units were mixed up, or a scale applied twice (IsaacLab-Arena"
        " PR #816, ManiSkill #1129). The longest side may be four times beyond that of nearly all such things.",
        remedy="Correct the scale, or the category where the thing is something else.",
        check=against_category,
    ),
    Rule(
        "SCL003",
        "up-axis",
        "warning",
        why="glTF is Y-up by its specification, but ManiSkill's own table.glb is Z-up (Genesis PR #2237): whoever converts it"
        " as specified lays the table on its side. The audit looks on which of the two axes the object stands on the"
        " origin's plane, and along which a container opens.",
        remedy="Turn the vertices to the format's up axis; do not leave it to a node's rotation.",
        check=up_axis,
    ),
    Rule(
        "SCL004",
        "unit-not-declared",
        "warning",
        why="A USD stage without metersPerUnit is in centimetres by USD's rule; half of the tools take metres instead"
        " (IsaacSim #52).",
        remedy="Author metersPerUnit = 1, and metres.",
        check=unit_not_declared,
    ),
)
