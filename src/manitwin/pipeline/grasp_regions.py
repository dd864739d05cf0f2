"""Association of grasps with the parts that their fingertips touch, and with the points at those places.

Source: paper, "Spatial Filtering and Semantic Association" (3 cm). Unlike the paper, a grasp is associated by contact instead
of with the nearest point: a knob 11 cm from a handle would otherwise inherit the handle's scenario.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property, partial
from typing import Any

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.engine.stage import Draft
from manitwin.geometry.distance import ClosestFaces, closest_points_on_triangles
from manitwin.geometry.grasp_diversity import fingertips
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.pipeline.object_state import load_solid
from manitwin.pipeline.parts import PARTS_FILE
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.part_records import NO_PART

READS = ("solid.npz", PARTS_FILE, "parts")
"""The artifacts that a stage needs for this association."""
PAD_HALF_M = 0.006
"""Half width of the three by three grid over each fingertip from which rays start; most pads are 16 to 22 mm wide."""
REACH_M = 0.008
"""Largest distance of a contact from the place implied by ``width_m``; real contacts are up to 6 mm off (95 %, measured)."""
PAD_M = 0.009
"""Half of a pad's width: points within this distance of a contact are under the fingertip."""
_OVER_PAD_M = np.array([(u, v) for u in (-PAD_HALF_M, 0.0, PAD_HALF_M) for v in (-PAD_HALF_M, 0.0, PAD_HALF_M)])
"""Ray starts over a fingertip, across and along the approach ``(9, 2)``."""
_ALL_OVER_PAD_M = np.array(
    [
        (u, v)
        for long in np.linspace(-PAD_M, PAD_M, 13)
        for short in (-PAD_M, 0.0, PAD_M)
        for u, v in ((long, short), (short, long))
    ]
)
"""A denser set of ray starts, 1.5 mm apart and out to the pad's border ``(78, 2)``, for thin objects."""
_NARROW, _BESIDE = 0.5, 0.25
"""Fractions of the nearby surface: below the first, a part is narrower than a fingertip; above the second, a neighbour counts."""
_SAMPLES = 20_000
_TIE = 1e-6  # smaller than the resolution of shares (a ninth of a fingertip), over all 255 parts
NOBODY = ""
"""The id of no part and of no point; null in the table."""


@dataclass(frozen=True)
class Contacts:
    """Contacts of the two fingertips of N grasps: ``positions_m (N, 2, 3)``, ``touches (N, 2)``, ``part (N, 2)``.

    ``share (N, 2)`` is the share of the fingertip that touches the part; 255 is no part.
    """

    positions_m: np.ndarray
    touches: np.ndarray
    part: np.ndarray
    share: np.ndarray

    def select(self, rows: np.ndarray) -> Contacts:
        """Return the contacts of some rows."""
        return Contacts(*(getattr(self, f.name)[rows] for f in fields(Contacts)))

    def put(self, rows: np.ndarray, others: Contacts) -> None:
        """Replace the contacts of some rows."""
        for field in fields(Contacts):
            getattr(self, field.name)[rows] = getattr(others, field.name)

    @staticmethod
    def joined(parts: Sequence[Contacts]) -> Contacts:
        """Return the concatenated contacts."""
        return Contacts(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Contacts)))


@dataclass(frozen=True)
class PartedSolid:
    """A closed solid with the part of each face, ``labels (F,) uint8`` as indices into ``part_ids`` (empty: no parts).

    ``opening_m`` is the distance of a parallel gripper's pads before closing; None for other hands, whose fingertips are
    assumed to touch the nearest surface.
    """

    solid: trimesh.Trimesh
    surface: RayCaster
    labels: np.ndarray
    part_ids: tuple[str, ...]
    radius_m: float
    opening_m: float | None = None

    @classmethod
    def read(cls, draft: Draft, gripper: Gripper, radius_m: float) -> PartedSolid:
        """Read the solid and parts for a gripper; ``radius_m`` is the association radius of points."""
        solid = load_solid(draft.path("solid.npz"))
        with np.load(draft.path(PARTS_FILE)) as arrays:
            labels = arrays["solid"]
        ids = tuple(part["id"] for part in draft.field("parts"))
        return cls(solid, RayCaster(solid), labels, ids, radius_m, pad_opening_m(gripper))

    def contacts(self, gripper_to_object: np.ndarray, depth_m: np.ndarray, width_m: np.ndarray) -> Contacts:
        """Return the contacts of grasps ``(N, 4, 4)``; with rays, only surface within reach of the expected place counts.

        Thin objects may lie between the rays, or be held by the border of the pads only, and are tried with the denser grid. An
        object beside the middle of an open hand is met by one fingertip first and pushed towards the other.
        """
        middle = fingertips(gripper_to_object, depth_m)
        found = self._contacts(middle, width_m / 2, width_m / 2, gripper_to_object)
        if self.opening_m is None or found.touches.all():
            return found
        lost = np.flatnonzero(~found.touches.all(1))
        half_m = width_m[lost] / 2
        wider = self._contacts(middle[lost], half_m, half_m, gripper_to_object[lost], _ALL_OVER_PAD_M)
        met = np.asarray(wider.touches.all(1))
        found.put(lost[met], wider.select(met))
        lost = lost[~met]
        plus_m, minus_m = self._met(middle[lost], gripper_to_object[lost], self.opening_m)
        beside = np.abs(plus_m + minus_m - width_m[lost]) <= REACH_M  # as wide as stated, but off-centre
        lost = lost[beside]
        found.put(lost, self._contacts(middle[lost], plus_m[beside], minus_m[beside], gripper_to_object[lost]))
        return found

    def _contacts(
        self,
        middle_m: np.ndarray,
        plus_m: np.ndarray,
        minus_m: np.ndarray,
        gripper_to_object: np.ndarray,
        offsets_m: np.ndarray = _OVER_PAD_M,
    ) -> Contacts:
        """Return the contacts of fingertips at the distances ``plus_m (N,)`` and ``minus_m (N,)`` from the middle along +X and
        -X.
        """
        find = self._nearest if self.opening_m is None else partial(self._by_rays, offsets_m=offsets_m)
        closing = gripper_to_object[:, :3, 0]
        plus = find(middle_m + plus_m[:, None] * closing, gripper_to_object, 1.0)
        minus = find(middle_m - minus_m[:, None] * closing, gripper_to_object, -1.0)
        return Contacts(*(np.stack(values, axis=1) for values in zip(plus, minus, strict=True)))

    def _met(
        self, middle_m: np.ndarray, gripper_to_object: np.ndarray, opening_m: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the distances from the middle ``(N,)`` along +X and -X at which the fingertips of an open hand meet the
        surface.
        """
        found = []
        for sign in (1.0, -1.0):
            starts, inward = _grid(
                middle_m + sign * opening_m / 2 * gripper_to_object[:, :3, 0], gripper_to_object, sign
            )
            distance, _ = self.surface.first_hits(starts.reshape(-1, 3), inward)
            first_m = distance.reshape(starts.shape[:2]).min(1)
            found.append(opening_m / 2 - first_m)
        return found[0], found[1]

    def regions(self, contacts: Contacts) -> np.ndarray:
        """Return the id of the part ``(N,)`` that is touched most; on a tie the first of the table; '' for none.

        The result is the same for a hand turned by half a turn about its approach, which is the same grasp.
        """
        share = np.where(contacts.part == NO_PART, 0.0, contacts.share)
        rows, most = np.arange(len(share)), (share - _TIE * contacts.part).argmax(1)
        index = np.where(share[rows, most] > 0, contacts.part[rows, most], NO_PART)
        names = np.array([*self.part_ids, *[NOBODY] * (NO_PART + 1 - len(self.part_ids))])
        return np.asarray(names[index])

    def assign_places(self, contacts: Contacts, places_m: np.ndarray) -> np.ndarray:
        """Return the index of the place ``(P, 3)`` that each grasp serves ``(N,)``; -1 for none.

        A fingertip must touch the place's own part within the radius; the nearest of several places counts. A part that is
        narrower there than a fingertip, such as the edge of a wall, may be held by adjacent parts. Without parts only the
        radius decides.
        """
        if not len(places_m) or not len(contacts.part):
            return np.full(len(contacts.part), -1)
        away_m = np.linalg.norm(contacts.positions_m[:, :, None] - places_m, axis=3)
        reached = contacts.touches[:, :, None] & (away_m <= self.radius_m)
        if self.part_ids:
            allowed = self._parts_at(places_m)
            reached &= allowed[np.arange(len(places_m)), contacts.part[:, :, None]]
        nearest_m = np.where(reached, away_m, np.inf).min(1)
        return np.where(np.isfinite(nearest_m.min(1)), nearest_m.argmin(1), -1)

    def _parts_at(self, places_m: np.ndarray) -> np.ndarray:
        """Return which parts a fingertip at each place may touch, ``(P, 256) bool``: its own part, and those adjacent to a narrow
        one.
        """
        keys = [place.tobytes() for place in places_m]
        new = [row for row, key in enumerate(keys) if key not in self._known_parts_at]
        if new:
            allowed = self._found_parts_at(places_m[new])
            self._known_parts_at.update((keys[row], found) for row, found in zip(new, allowed, strict=True))
        return np.stack([self._known_parts_at[key] for key in keys])

    @cached_property
    def _known_parts_at(self) -> dict[bytes, np.ndarray]:
        """Cached results by place, as a search queries the same few places after every trial."""
        return {}

    def _found_parts_at(self, places_m: np.ndarray) -> np.ndarray:
        own = self.labels[self._closest.find_closest(places_m)[0]]
        allowed = np.zeros((len(places_m), NO_PART + 1), bool)
        labels, tree = self._samples
        for row, near in enumerate(tree.query_ball_point(places_m, PAD_M)):
            shares = np.bincount(labels[near], minlength=NO_PART + 1) / max(len(near), 1)
            if shares[own[row]] < _NARROW:
                allowed[row] = shares >= _BESIDE
            allowed[row, own[row]] = True
        allowed[:, NO_PART] = False
        return allowed

    @cached_property
    def _closest(self) -> ClosestFaces:
        return ClosestFaces(self.solid)

    @cached_property
    def _samples(self) -> tuple[np.ndarray, cKDTree]:
        """The parts ``(N,)`` of surface samples, and a k-d tree of their positions."""
        positions, _, faces = sample_surface(self.solid, _SAMPLES, np.random.default_rng(0))
        return self.labels[faces], cKDTree(positions)

    def _by_rays(
        self, place_m: np.ndarray, gripper_to_object: np.ndarray, sign: float, offsets_m: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Cast rays along the closing axis, from around each expected contact into the object."""
        begin_m = place_m + sign * REACH_M * gripper_to_object[:, :3, 0]
        grid, inward = _grid(begin_m, gripper_to_object, sign, offsets_m)
        starts = grid.reshape(-1, 3)
        distance, face = self.surface.first_hits(starts, inward)
        met = face >= 0
        face = np.maximum(face, 0)
        met &= (distance <= 2 * REACH_M) & (np.einsum("ij,ij->i", self.surface.face_normals[face], inward) < 0)
        hits = (starts + np.where(met, distance, 0.0)[:, None] * inward).reshape(grid.shape)
        met, part = met.reshape(grid.shape[:2]), self.labels[face].reshape(grid.shape[:2])
        names = np.unique(self.labels)
        on = met[:, :, None] & (part[:, :, None] == names)
        best = on.sum(1).argmax(1)
        mine = np.take_along_axis(on, best[:, None, None], 2)[:, :, 0]
        count = mine.sum(1)
        center = (hits * mine[:, :, None]).sum(1) / np.maximum(count, 1)[:, None]
        positions = np.where((count > 0)[:, None], center, place_m)
        return positions, count > 0, np.where(count > 0, names[best], NO_PART), count / grid.shape[1]

    def _nearest(
        self, place_m: np.ndarray, gripper_to_object: np.ndarray, sign: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        if not len(place_m):
            return place_m, np.zeros(0, bool), np.zeros(0, np.uint8), np.zeros(0)
        face, _ = self._closest.find_closest(place_m)
        positions, _ = closest_points_on_triangles(place_m, np.asarray(self.solid.triangles)[face])
        return positions, np.ones(len(face), bool), self.labels[face], np.ones(len(face))


def pad_opening_m(gripper: Gripper) -> float | None:
    """Return the distance of a parallel gripper's pads before closing; None for other hands."""
    return gripper.opening_m if isinstance(gripper, ParallelGripper) else None


def _grid(
    place_m: np.ndarray, gripper_to_object: np.ndarray, sign: float, offsets_m: np.ndarray = _OVER_PAD_M
) -> tuple[np.ndarray, np.ndarray]:
    """Return ray starts ``(N, K, 3)`` over a fingertip at each place, and the inward direction of each ``(K N, 3)``."""
    closing, across, approach = (gripper_to_object[:, :3, k] for k in range(3))
    starts = place_m[:, None] + offsets_m @ np.stack([across, approach], axis=1)
    return starts, np.repeat(-sign * closing, len(offsets_m), axis=0)


def region_columns(
    grasps: dict[str, np.ndarray],
    held: PartedSolid,
    functional: Sequence[dict[str, Any]],
    grasp: Sequence[dict[str, Any]],
) -> dict[str, np.ndarray]:
    """Return the table columns with the associations of grasps (arrays of ``proposals.npz``): ids, '' for none.

    ``distance_to_point_m`` is the distance of the nearest contact from the nearest of all points.
    """
    contacts = held.contacts(grasps["gripper_to_object"], grasps["depth_m"], grasps["width_m"])
    everywhere = np.array([point["position_m"] for point in (*functional, *grasp)], float).reshape(-1, 3)
    away_m = np.linalg.norm(contacts.positions_m[:, :, None] - everywhere, axis=3)
    columns = {"part_id": held.regions(contacts), "distance_to_point_m": away_m.min((1, 2))}
    for name, points in (("functional_point_id", functional), ("grasp_point_id", grasp)):
        ids = np.array([*(point["id"] for point in points), NOBODY])
        places = np.array([point["position_m"] for point in points], float).reshape(-1, 3)
        columns[name] = ids[held.assign_places(contacts, places)]
    return columns
