"""FRI rules: plausibility of friction and restitution for dry solids."""

from __future__ import annotations

import math
from collections.abc import Iterator

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset

LARGEST = 2.0
"""Clean soft rubber on rough ground has little above 1 (engineering handbooks)."""


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an asset that declares no friction."""
    if measured.asset.static or not measured.asset.collision:  # without collision shapes, friction has no effect
        return
    contact = measured.asset.contact
    if contact.friction_static is None and contact.friction_dynamic is None and not contact.of_others:
        yield Complaint("no friction is declared: the scene's default decides whether a grasp holds")


def out_of_range(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report coefficients that are impossible for dry solids; 0 is allowed for parts of robots, whose castors often have it."""
    contact, of_a_robot = measured.asset.contact, measured.asset.partial
    for name, value in (("static", contact.friction_static), ("dynamic", contact.friction_dynamic)):
        if value is not None and not _possible(value) and not (of_a_robot and value == 0):
            yield Complaint(
                f"the {name} friction is {value:g}, dry solids have more than 0 and up to {LARGEST:g}",
                values={f"friction_{name}": value},
            )


def _possible(value: float) -> bool:
    return math.isfinite(value) and 0 < value <= LARGEST


def dynamic_above_static(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a dynamic friction above the static friction."""
    static, dynamic = measured.asset.contact.friction_static, measured.asset.contact.friction_dynamic
    if static is None or dynamic is None or not (_possible(static) and _possible(dynamic)):
        return
    if dynamic > static + 1e-9:
        yield Complaint(
            f"the dynamic friction {dynamic:g} is above the static {static:g}",
            values={"friction_static": static, "friction_dynamic": dynamic},
        )


def restitution_out_of_range(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a restitution outside of 0 to 1."""
    restitution = measured.asset.contact.restitution
    if restitution is not None and not 0 <= restitution <= 1:
        yield Complaint(f"the restitution is {restitution:g}, it is 0 to 1", values={"restitution": restitution})


RULES = (
    Rule(
        "FRI001",
        "friction-missing",
        "warning",
        why="URDF cannot say it, so it gets lost, and 0.5 of RoboTwin's scene or 1.0 of another's takes its place: success"
        " rates of two simulators then mean different things.",
        remedy="Declare it: <contact><lateral_friction> beside a URDF's link, friction of a geom, a physics material in USD.",
        check=missing,
    ),
    Rule(
        "FRI002",
        "friction-out-of-range",
        "error",
        why="Friction was turned up until grasps held (DexVerse sets 2.0 for all objects of a set), or is zero or negative by a"
        " slip: what holds then holds for the wrong reason.",
        remedy="Take a measured value of the material: docs/priors.md lists them with sources.",
        check=out_of_range,
    ),
    Rule(
        "FRI003",
        "friction-dynamic-above-static",
        "error",
        why="RoboDojo's loader takes 0.6 static and 1.5 dynamic where a file says nothing (RoboDojo #41): an object that slides"
        " is braked harder than one at rest, which no dry contact does.",
        remedy="Exchange the two if they were swapped, else take measured values.",
        check=dynamic_above_static,
    ),
    Rule(
        "FRI004",
        "restitution-out-of-range",
        "error",
        why="Above 1 an object gains energy at every bounce; below 0 has no meaning.",
        remedy="Take the material's: 0.1 to 0.6 for most household things.",
        check=restitution_out_of_range,
    ),
)
