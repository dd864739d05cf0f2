"""Standing body of revolution with the camera's perspective: its profile and view are fitted by least squares.

The visual hull of a silhouette (``revolution``) assumes a distant camera, but nearby the upper and the lower end are seen
less and more steeply. Its elevation is therefore about 8 degrees too high, and an object seen from 55 degrees becomes a
quarter too long. Here the hull at each of several elevations is the initial value of a least-squares fit
(``templates.fitting``) of the radii at the corners of its profile and of a pinhole camera; the result is selected by edges
and silhouette.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.geometry.solids.shapes import SolidError, lathe
from manitwin.models.generators.lift.revolution import (
    LEVEL_DEG,
    ROUND_ENDS_DEG,
    end_elevations,
    half_widths,
    largest_profile,
)
from manitwin.models.generators.lift.silhouette import CROP_SIDE_PX
from manitwin.models.generators.lift.texture import crop_object
from manitwin.models.generators.templates.fitting.evidence import Evidence, extract_evidence
from manitwin.models.generators.templates.fitting.fit import TemplateFit, first_solid_fit
from manitwin.models.generators.templates.fitting.least_squares import PlacedView, Problem
from manitwin.models.generators.templates.fitting.residual import residual
from manitwin.models.generators.templates.fitting.search import Candidate, steep_cost
from manitwin.models.generators.templates.fitting.shape import ShapeFamily
from manitwin.models.generators.templates.fitting.view import LEAST_PERSPECTIVE, MOST_PERSPECTIVE, View, frame_placement
from manitwin.models.generators.templates.template import Measure, Model, Template

UPRIGHT_CATEGORY = "can"
"""A category of standing, round objects, whose resting pose a body of revolution has."""
STEPS_DEG = (0.0, 4.0, 8.0, 12.0, 16.0)
"""Steps below the elevation of the hull; for 54 photos of templates from 10, 30 and 55 degrees it is 0 to 16 degrees too high."""
LEVEL_START_DEG = 2.0
MOST_CORNERS, CORNER_SHARE, COARSER = 12, 0.006, 1.2
"""Maximum number of corners of a simplified profile, its initial tolerance over the height, and the factor to increase it."""
LEAST_SAMPLES = 8  # minimum samples of a profile
HEIGHT_M = 0.1  # arbitrary: a photo does not determine the size
SPREAD = 0.12  # relative error of the hull's radii
STRETCH = (0.5, 1.0, 2.0)  # range of a common factor on all radii, for an error of the elevation
_AXIS = 1e-3  # of the height: minimum radius of a ring
_ROUNDS, _ENOUGH = 12, 0.9995


@dataclass(frozen=True)
class _Start:
    """A profile, (K, 2) of heights and radii in pixels, and the elevation at which it is the hull of a silhouette."""

    profile: np.ndarray
    elevation_deg: float


def turned_solid(rgba: np.ndarray, focal_mm: float | None = None) -> TemplateFit | None:
    """Return the body of revolution about the vertical that explains ``rgba (H, W, 4) uint8``, whose alpha is the mask.

    None if no profile gives a solid. ``focal_mm`` is the 35 mm equivalent focal length, if known.
    """
    tilted, level = _starts(crop_object(rgba, CROP_SIDE_PX).mask)
    evidence = extract_evidence(rgba, focal_mm)
    found = [
        min(candidates, key=_outline_cost)
        for starts in (tilted, level)
        if (candidates := [each for start in starts if (each := _fit_from_start(start, evidence)) is not None])
    ]
    return first_solid_fit(sorted(found, key=lambda each: each.residual.cost), evidence)


def _starts(mask: np.ndarray) -> tuple[list[_Start], list[_Start]]:
    """Return initial values for a camera that looks down, and for a level camera if the silhouette permits it."""
    rows, widths, column_px = half_widths(mask)
    upper, lower = end_elevations(rows, widths, column_px)
    highest = (upper + lower) / 2
    elevations = [highest - step for step in STEPS_DEG if highest - step > LEVEL_DEG]
    is_level = not elevations or min(upper, lower) <= LEVEL_DEG or upper > ROUND_ENDS_DEG

    def at(elevation_deg: float) -> list[_Start]:
        turned = largest_profile(rows, widths, column_px, 0.0 if elevation_deg <= LEVEL_DEG else elevation_deg)
        if len(turned.heights) < LEAST_SAMPLES:
            return []
        return [_Start(_simplify_profile(turned.heights, turned.radii), elevation_deg)]

    return [start for each in elevations for start in at(each)], at(LEVEL_START_DEG) if is_level else []


def _simplify_profile(heights: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return a profile simplified to a polyline with few corners ``(K, 2)``, upward (Douglas and Peucker 1973)."""
    points = np.column_stack([heights, radii]).astype(np.float32)[:, None]
    tolerance = CORNER_SHARE * float(np.ptp(heights))
    while len(corners := cv2.approxPolyDP(points, tolerance, closed=False)[:, 0]) > MOST_CORNERS:
        tolerance *= COARSER
    return np.asarray(corners, float)


def _family(profile: np.ndarray) -> ShapeFamily:
    """Return the family of bodies with corners at the heights of a profile ``(K, 2)``, upward, and radii near its radii."""
    height = float(profile[-1, 0] - profile[0, 0])
    levels, radii = (profile[:, 0] - profile[0, 0]) / height, np.maximum(profile[:, 1] / height, _AXIS)
    names = [f"radius_{number}" for number in range(len(radii))]
    measures = {"height_m": Measure(HEIGHT_M, HEIGHT_M, HEIGHT_M, "m"), "width": Measure(*STRETCH, "")}
    for name, radius in zip(names, radii.tolist(), strict=True):
        measures[name] = Measure((1 - SPREAD) * radius, radius, (1 + SPREAD) * radius, "")

    def build(*, height_m: float, width: float, **shares: float) -> Model:
        across = np.maximum([width * shares[name] for name in names], _AXIS)
        return Model().add("body", lathe(height_m * np.column_stack([across, levels])))

    return ShapeFamily(Template(UPRIGHT_CATEGORY, "household", measures, {"body": ("cardboard",)}, build))


def _fit_from_start(start: _Start, evidence: Evidence) -> Candidate | None:
    """Return the least-squares fit from a start; None if it gives no solid."""
    try:
        family = _family(start.profile)
    except SolidError:
        return None
    spreads = np.zeros(len(family.free))
    solid = family.solid(spreads)
    if solid is None:
        return None
    perspective = float(np.clip(evidence.perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE))
    ahead = View(0.0, float(np.radians(start.elevation_deg)), 0.0, perspective)
    scale, x, y = frame_placement(ahead.project(solid.vertices)[0])
    view = View(0.0, ahead.elevation_rad, 0.0, perspective, scale, x, y)
    at, (placed,) = Problem(family, [evidence], True).solve(
        spreads, [PlacedView(view, True)], measures=True, rounds=_ROUNDS, enough=_ENOUGH
    )
    final = family.solid(at)
    if final is None:
        return None
    return Candidate(family, at, placed.view, True, residual(final, placed.view, evidence))


def _outline_cost(candidate: Candidate) -> float:
    """Return the cost of silhouette and edges; shading separates a body from other shapes, but not its elevation."""
    return candidate.residual.outline_cost + steep_cost(candidate.view)
