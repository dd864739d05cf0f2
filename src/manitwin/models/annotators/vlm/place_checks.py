"""Checks of the label and grasp type of a place on an object against its geometry."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from manitwin.geometry.parts.shape import LEAST_HANDLE_REACH, Shape, measure_shape
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.symmetry import Symmetries, find_symmetries
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import PointsRequest

FINGERS_BETWEEN_M = 0.02  # depth below the surface that fingers reach from above (Franka hand: finger pads of 18 mm)
LEAST_PLAY_M = 0.002  # of the opening: clearance of the fingers around the object
SAME_PLACE_M, SAME_PLACE_SHARE = 0.02, 0.25  # a fingertip's width: grasps closer than this are the same place
UPPER, LOWER = 0.6, 0.4  # shares of the height: a base is not above, a top not below
LYING_COSINE = 0.5  # maximum vertical component of the axis of a lying object
# maximum ratio of the second to the third side of a rolling object; share of its length at each end
ROUND, END_SHARE = 1.25, 0.2
PINCH_M = 0.010  # maximum width of a pinch with fingertips; wider parts are held with flat fingers
_PINCH_SLACK = 2.0  # tolerance factor, since widths are measured at a point
_DIRECTIONS = 12  # closing directions of a gripper that approaches along the normal

_RIM = re.compile(r"\b(rim|mouth|lip|brim|opening edge|open top|opening)\b")
_BASE = re.compile(
    r"^(?:the |flat |outer |under)*(base|bottom|underside|foot|sole)(?: surface| face| rim| edge| center| side)?$"
)
_LOW_RIM = re.compile(r"\b(base|bottom|lower|underside|foot)\b")
_TOP = re.compile(r"^(?:the |flat )*(top|lid|upper side)(?: surface| face| edge| center| side)?$")
_HANDLE = re.compile(r"\b(handle|grip handle)\b")
_NOT_ITS_HANDLE = re.compile(r"\b(attachment|joint|base of|root|junction|opposite|connection)\b")


@dataclass(frozen=True)
class PlaceChecks:
    """Checks for one object's candidates, with cached measurements of its geometry."""

    request: PointsRequest

    @cached_property
    def shape(self) -> Shape:
        """Measurements of the shape, as the rules use them."""
        subject = self.request.subject
        prior = find_prior(subject.name or subject.known_as)
        return measure_shape(
            subject.solid,
            self.request.center_of_mass_m,
            "wide" if prior is None else prior.head_end,
            None if prior is None else prior.stands,
            np.random.default_rng(subject.seed),
        )

    @cached_property
    def symmetries(self) -> Symmetries:
        """Rigid motions that map the solid onto itself."""
        subject = self.request.subject
        return find_symmetries(subject.solid, np.random.default_rng(subject.seed))

    @cached_property
    def same_place_m(self) -> float:
        """Maximum distance (m) of two candidates that count as one place: 2 cm, or a quarter of the length of small objects."""
        return min(SAME_PLACE_M, SAME_PLACE_SHARE * float(self.request.subject.solid.extents.max()))

    @cached_property
    def spacing_m(self) -> float:
        """Median distance (m) of a candidate to its nearest neighbour."""
        positions = self.request.positions_m
        apart = np.linalg.norm(positions[:, None] - positions[None], axis=2)
        np.fill_diagonal(apart, np.inf)
        return float(np.median(apart.min(1)))

    @cached_property
    def caster(self) -> RayCaster:
        """Ray caster of the solid."""
        return RayCaster(self.request.subject.solid)

    def label_contradiction(self, label: str, candidate: int) -> str | None:
        """Return how geometry contradicts that a candidate is on a part with this name, None if it does not."""
        words = " ".join(label.lower().split())
        position = self.request.positions_m[candidate]
        height = self._share_of_height(position)
        opening = self.shape.opening
        if _RIM.search(words) and not _LOW_RIM.search(words) and opening is not None and opening.axis[2] > 0.9:
            away_m = self._from_rim_m(position)
            if away_m > 1.5 * self.spacing_m:
                return f"it is {1000 * away_m:.0f} mm from the rim of the opening"
        at_end = self._at_end_of_lying(position)
        if _BASE.search(words) and height > UPPER and not at_end:
            return f"it is at {100 * height:.0f} % of the height, not at the bottom"
        if _TOP.search(words) and height < LOWER and not at_end:
            return f"it is at {100 * height:.0f} % of the height, not at the top"
        if _HANDLE.search(words) and not _NOT_ITS_HANDLE.search(words):
            away_m = self._from_side_handle_m(position)
            if away_m > self.spacing_m:
                return f"it is on the body, {1000 * away_m:.0f} mm from the handle that sticks out of it"
        return None

    def grasp_contradiction(self, kind: str, candidate: int) -> str | None:
        """Return why two fingers cannot grasp the object at a candidate, None if they can or for another grasp type."""
        if kind not in ("parallel_jaw", "pinch"):
            return None
        width_m, opening_m = self.width_m(candidate), self.request.max_opening_m
        if width_m <= opening_m - LEAST_PLAY_M:
            if kind == "pinch" and width_m > _PINCH_SLACK * PINCH_M:
                return f"the object is {1000 * width_m:.0f} mm wide there, which is no pinch but a parallel_jaw grasp"
            return None
        wide, opening = f"{1000 * width_m:.0f} mm", f"{1000 * opening_m:.0f} mm"
        return f"the object is at least {wide} wide there, but the fingers of a {kind} grasp open to {opening}"

    def width_phrase(self, candidate: int) -> str:
        """Return the width at a candidate as '23 mm', or 'unknown' if a ray finds no opposite surface."""
        width_m = self.width_m(candidate)
        return f"{1000 * width_m:.0f} mm" if width_m > 0 else "unknown"

    def width_m(self, candidate: int) -> float:
        """Return the minimum width (m) that fingers have to span at a candidate.

        It is the thickness along the normal, or the width across: the distance between the surfaces hit by opposite rays in
        tangential directions, from a point a finger's depth below the surface.
        """
        position, normal = self.request.positions_m[candidate], self.request.normals[candidate]
        through, _ = self.caster.first_hits((position - 1e-5 * normal)[None], -normal[None])
        if not np.isfinite(through[0]):
            return 0.0  # no opposite surface: the mesh is imperfect and gives no width
        inside = position - normal * min(FINGERS_BETWEEN_M, float(through[0]) / 2)
        across = _tangents(normal)
        ahead, _ = self.caster.first_hits(np.repeat(inside[None], len(across), axis=0), across)
        behind, _ = self.caster.first_hits(np.repeat(inside[None], len(across), axis=0), -across)
        return float(min(through[0], (ahead + behind).min()))

    def _share_of_height(self, position: np.ndarray) -> float:
        low, high = self.shape.bounds_m[:, 2]
        return float((position[2] - low) / max(high - low, 1e-9))

    def _at_end_of_lying(self, position: np.ndarray) -> bool:
        """Tell whether a place is at an end of a lying, rolling object: such an end is its bottom or top when it stands."""
        axis, sides = self.shape.axis, np.sort(self.shape.obb_extents_m)
        lies = abs(float(axis.direction[2])) < LYING_COSINE and sides[1] < ROUND * sides[0]
        along = float(axis.along(position[None])[0])
        return lies and not END_SHARE < along < 1 - END_SHARE

    def _from_rim_m(self, position: np.ndarray) -> float:
        opening = self.shape.opening
        assert opening is not None
        offset = position - opening.center_m
        above = float(offset @ opening.axis)
        beyond = float(np.linalg.norm(offset - above * opening.axis)) - 1.2 * opening.rim_radius_m
        # a rim may rise to a lip or spout, so places above it and within its circle belong to it
        return float(np.hypot(max(-above, 0.0) + max(above - self.spacing_m, 0.0), max(beyond, 0.0)))

    def _from_side_handle_m(self, position: np.ndarray) -> float:
        """Return the distance (m) from the nearest handle beside or over an upright body; 0 if there is none."""
        if self.shape.side_handle is None:
            return 0.0
        body, surface = self.shape.body, self.shape.surface_m
        handles = [p for p in body.protrusions if p.reach_m > LEAST_HANDLE_REACH * body.radius_m.max()]
        handles = handles if body.over is None else [body.over]
        of_handle = np.any([body.protrusion_mask(surface, handle) for handle in handles], axis=0)
        return float(np.linalg.norm(surface[of_handle] - position, axis=1).min()) if of_handle.any() else 0.0


def _tangents(normal: np.ndarray) -> np.ndarray:
    """Return unit vectors ``(12, 3)`` perpendicular to a normal, over half a turn."""
    first = np.cross(normal, np.eye(3)[int(np.abs(normal).argmin())])
    first /= np.linalg.norm(first)
    angles = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    return np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * np.cross(normal, first)
