"""COM rules: plausibility of the centre of mass."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.fix import write_missing_inertial
from manitwin.assets.audit.measured import MeasuredAsset

SLACK_M, SLACK_SHARE = 0.001, 0.01
"""Tolerance for a centre of mass outside the hull, in metres and as share of the longest side: hulls are rounded."""

AWAY_SHARE = 0.1
"""A centre of mass at (0, 0, 0) counts as forgotten if the shape's is farther away, as share of the longest side."""
SURFACE_SHARE = 0.45
"""It also counts as forgotten if that of the shape is this share of a side away along it, at the surface of a flat object."""


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a mass and an inertia without a centre of mass; if the inertia is missing too, INE001 reports both."""
    inertial = measured.asset.inertial
    declared = inertial.mass_kg is not None and inertial.inertia_kg_m2 is not None
    if declared and inertial.center_of_mass_m is None:
        yield Complaint("a mass and an inertia are declared, but no centre of mass")


def outside(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a centre of mass outside the convex hull of the body."""
    center = measured.asset.inertial.center_of_mass_m
    if center is None or not len(measured.hull) or measured.asset.inertial.mass_kg == 0:  # reported by MAS002
        return
    if not np.isfinite(center).all():
        yield Complaint(f"the centre of mass is {_millimetres(center)} mm")
        return
    beyond = float(measured.hull.depth_outside(center[None])[0])
    if beyond > max(SLACK_M, SLACK_SHARE * measured.longest_m):
        yield Complaint(
            f"the centre of mass {_millimetres(center)} mm lies {1000 * beyond:.3g} mm outside the object's convex hull",
            values={"center_of_mass_m": center.tolist(), "outside_m": beyond},
        )


def left_at_origin(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a centre of mass at the origin if that of the shape is elsewhere."""
    center = measured.asset.inertial.center_of_mass_m
    if center is None or center.any() or not len(measured.hull) or measured.complaints(outside):
        return
    if measured.asset.inertial.computed:  # it follows from the masses of the shapes
        return
    if measured.asset.inertial.mass_kg == 0:  # reported by MAS002
        return
    shapes = measured.shapes if len(measured.shapes) else measured.hull
    expected = shapes.uniform_solid.center_of_mass_m
    away = float(np.linalg.norm(expected))
    at_the_surface = np.abs(expected) > np.maximum(SURFACE_SHARE * np.ptp(measured.hull.boxes, axis=(0, 1)), SLACK_M)
    if away > AWAY_SHARE * measured.longest_m or at_the_surface.any():
        yield Complaint(
            f"the centre of mass is the origin, but the shape's lies at {_millimetres(expected)} mm: it was left out or"
            " forgotten",
            values={"expected_m": expected.tolist(), "away_m": away},
        )


def _millimetres(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{round(1000 * float(value), 3) + 0.0:.3g}" for value in point) + ")"  # to the micrometre


RULES = (
    Rule(
        "COM001",
        "center-of-mass-missing",
        "warning",
        why="Where none is said, one engine takes the origin and the next the centroid of the collision shapes: the same mug"
        " tips in one and stands in the other.",
        remedy="Write it beside the mass. `--fix` writes the centroid of the collision hulls into a URDF.",
        check=missing,
        fix=write_missing_inertial,
    ),
    Rule(
        "COM002",
        "center-of-mass-outside",
        "error",
        why="No body's centre of mass is outside its convex hull. It comes from another frame or unit, or from a mesh that is"
        " not closed (obj2mjcf #31: the centre of mass at the side).",
        remedy="Give it in the axes and metres of the geometry.",
        check=outside,
    ),
    Rule(
        "COM003",
        "center-of-mass-at-origin",
        "warning",
        why="EmbodiedGen's URDFs leave the inertial's origin at zero whatever the shape; an object whose origin is at its"
        " bottom then behaves as if all of its weight were there.",
        remedy="Write the centroid, or where the matter is.",
        check=left_at_origin,
    ),
)
