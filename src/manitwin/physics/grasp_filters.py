"""Filters of proposed grasps: the contact of the pads, the clearance of the open hand, and that from a supporting plane.

Contact is found by a grid of rays from each open pad, inwards. A grasp that is proven in the air may have its fingertips
below the plane that the object will be picked from: of the fork, the plate and the scissors of the test set every one had.
The last millimetres of the pads hold flat things as well, so such a grasp is raised.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np

from manitwin.geometry.boxes import box_corners
from manitwin.geometry.ray_caster import RayCaster
from manitwin.physics.grasp_selection import Merits
from manitwin.physics.pad_loads import PressedPads
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.parallel import ParallelGripper

ACROSS, ALONG = 3, 5  # cells of a pad
PAD_CELLS = ACROSS * ALONG
INSET = 0.87  # the outermost rays lie inside the pad's edge
SAME_CONTACT_M = 0.0015  # cells this close behind the first one touch too, as soft pads do
PAD_GIVE_M = 0.0005
"""What pads give under the closing force: cells this close touch before the object has turned flat to them."""
# The pad filter: two cells of fifteen, contact centres at most 6 mm apart, normals inside the narrowed friction cone.
MIN_CELLS, MAX_OFFSET_M, CONE_SAFETY = 2, 0.006, 1.5
CLEARANCE_M = 0.0005
# What the simulation is likely to hold, measured on 1,799 trials of 18 objects: of grasps with levers under 50 mm 98 %
# held, beyond 80 mm 47 %; of those on 2 cells 73 %, on 6 and more 92 %.
GOOD_CELLS = 3
GOOD_LOAD_SHARE = 0.5  # half of what pads bear: of 4,385 trials of 96 templates 91 % held below it, 48 % beyond
POOR_LEVER_M = 0.1  # costs as much as half of what pads bear
GOOD_COST = 0.5

SUPPORT_CLEARANCE_M = 0.002
"""Between the open hand and the plane."""
MIN_DESCENT = 0.5
"""The least cosine between the approach and straight down at which a hand is raised along it."""


@dataclass(frozen=True)
class PadContacts:
    """The contacts of both pads of N grasps with an object.

    ``width_m`` distance of the two contacts along the closing axis (inf where a pad meets nothing), ``cells`` the
    smaller number of touching cells of the two pads, ``from_end_m`` the distance of a contact's centre from the end of its pad
    along the approach, the smaller of two, ``offset_m`` the distance of the two contacts' centres across the closing
    axis, ``alignment`` the smaller mean cosine of surface normal and closing axis, ``lever_m`` the distance of
    the centre of mass from the line through the contacts, ``pads`` where they press once they are flat on the object,
    ``unturned`` where before.
    """

    width_m: np.ndarray
    cells: np.ndarray
    from_end_m: np.ndarray
    offset_m: np.ndarray
    alignment: np.ndarray
    lever_m: np.ndarray
    pads: PressedPads
    unturned: PressedPads

    def take(self, index: np.ndarray) -> PadContacts:
        """Return the contacts at ``index``."""
        some = {f.name: getattr(self, f.name)[index] for f in fields(self) if f.name not in ("pads", "unturned")}
        return PadContacts(pads=self.pads.take(index), unturned=self.unturned.take(index), **some)


def pad_contacts(
    gripper: ParallelGripper, gripper_to_object: np.ndarray, hulls: RayCaster, center_of_mass_m: np.ndarray
) -> PadContacts:
    """Cast rays from both open pads of grasps ``(N, 4, 4)`` against the union of the hulls."""
    plus, minus = (_pad_hits(gripper, gripper_to_object, hulls, side) for side in (1, -1))
    return _both_pads(gripper, gripper_to_object, plus, minus, center_of_mass_m)


@dataclass(frozen=True)
class _Touched:
    """``cells (N,)`` of a pad that touch, their ``center_m (N, 2)`` on the pad, ``least_m`` and ``most_m (N, 2)`` their ends."""

    cells: np.ndarray
    center_m: np.ndarray
    least_m: np.ndarray
    most_m: np.ndarray

    def take(self, index: np.ndarray) -> _Touched:
        return _Touched(**{f.name: getattr(self, f.name)[index] for f in fields(self)})


@dataclass(frozen=True)
class _PadHits:
    """What one pad of each of N grasps meets.

    ``depth_m (N,)`` of the first cell's contact (inf: nothing), ``soft`` and ``unturned`` the cells that touch as far as soft
    pads conform and as far as they give before the object turns, ``alignment (N,)`` the mean cosine of the soft ones' normals and
    the closing axis.
    """

    depth_m: np.ndarray
    soft: _Touched
    unturned: _Touched
    alignment: np.ndarray

    def take(self, index: np.ndarray) -> _PadHits:
        return _PadHits(self.depth_m[index], self.soft.take(index), self.unturned.take(index), self.alignment[index])


def _pad_hits(gripper: ParallelGripper, gripper_to_object: np.ndarray, hulls: RayCaster, side: int) -> _PadHits:
    half_y, half_z = gripper.pad_half_extents_m
    y, z = np.meshgrid(
        np.linspace(-INSET * half_y, INSET * half_y, ACROSS),
        np.linspace(-INSET * half_z, INSET * half_z, ALONG) + gripper.tip_depth_m,
        indexing="ij",
    )
    grid = np.stack([y.ravel(), z.ravel()], axis=1)
    rotation, origin = gripper_to_object[:, :3, :3], gripper_to_object[:, :3, 3]
    pads = np.column_stack([np.full(len(grid), side * gripper.opening_m / 2), grid])
    starts, inwards = _placed(pads, rotation, origin).reshape(-1, 3), -side * rotation[:, :, 0]
    distance, face = hulls.first_hits(starts, np.repeat(inwards.astype(np.float32), len(grid), axis=0))
    depth = distance.reshape(-1, len(grid))
    first_m = depth.min(1)
    near = np.isfinite(depth)
    soft = (depth <= first_m[:, None] + SAME_CONTACT_M) & near
    unturned = (depth <= first_m[:, None] + PAD_GIVE_M) & near
    touches = np.flatnonzero(soft)
    normals, inwards = hulls.face_normals[face[touches]], inwards[touches // len(grid)]
    cosine = np.zeros(soft.size)
    cosine[touches] = -(normals[:, 0] * inwards[:, 0] + normals[:, 1] * inwards[:, 1] + normals[:, 2] * inwards[:, 2])
    touched = _touched(soft, grid)
    alignment = cosine.reshape(soft.shape).sum(1) / np.maximum(touched.cells, 1)
    return _PadHits(first_m, touched, _touched(unturned, grid), alignment)


def _placed(points_m: np.ndarray, rotation: np.ndarray, origin_m: np.ndarray) -> np.ndarray:
    """Return points ``(K, 3)`` of a hand at each of its poses, ``(N, 3, 3)`` and ``(N, 3)``: ``(N, K, 3)``.

    Axis by axis, ten times as fast as an einsum over axes of three, whose sums these are to the bit.
    """
    placed = np.empty((len(rotation), len(points_m), 3))
    x, y, z = points_m.T
    for axis in range(3):
        along = rotation[:, axis, :, None]
        placed[:, :, axis] = along[:, 0] * x + along[:, 2] * z + along[:, 1] * y + origin_m[:, axis, None]
    return placed


def _touched(touching: np.ndarray, grid: np.ndarray) -> _Touched:
    """Sum up which cells touch ``(N, C)`` of those at ``grid (C, 2)``."""
    count, least_m, most_m = _ends_of_cells(tuple(map(tuple, grid.tolist())))
    which = touching @ (1 << np.arange(len(grid)))
    return _Touched(
        count[which],
        touching @ grid / np.maximum(count[which], 1)[:, None],
        least_m[which],
        most_m[which],
    )


@lru_cache(maxsize=8)
def _ends_of_cells(grid: tuple[tuple[float, float], ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return number ``(2^C,)``, least and most ``(2^C, 2)`` of every choice among a pad's cells ``(C, 2)``, by its bits."""
    count: np.ndarray = np.zeros(1, dtype=np.int64)
    least, most = np.full((1, 2), np.inf), np.full((1, 2), -np.inf)
    for cell in grid:
        count = np.concatenate([count, count + 1])
        least = np.concatenate([least, np.minimum(least, cell)])
        most = np.concatenate([most, np.maximum(most, cell)])
    return count, least, most


def _both_pads(
    gripper: ParallelGripper,
    gripper_to_object: np.ndarray,
    plus: _PadHits,
    minus: _PadHits,
    center_of_mass_m: np.ndarray,
) -> PadContacts:
    rotation, origin = gripper_to_object[:, :3, :3], gripper_to_object[:, :3, 3]
    centers_m = (plus.soft.center_m, minus.soft.center_m)
    line = np.einsum("nij,nj->ni", rotation[:, :, 1:], (centers_m[0] + centers_m[1]) / 2) + origin
    met = np.isfinite(plus.depth_m + minus.depth_m)
    width_m = np.where(met, gripper.opening_m - plus.depth_m - minus.depth_m, np.inf)
    off_m = np.subtract(minus.depth_m, plus.depth_m, out=np.zeros_like(width_m), where=met) / 2
    return PadContacts(
        width_m=width_m,
        cells=np.minimum(plus.soft.cells, minus.soft.cells),
        from_end_m=gripper.tip_depth_m
        + gripper.pad_half_extents_m[1]
        - np.maximum(centers_m[0][:, 1], centers_m[1][:, 1]),
        offset_m=np.linalg.norm(centers_m[0] - centers_m[1], axis=1),
        alignment=np.minimum(plus.alignment, minus.alignment),
        lever_m=np.linalg.norm(np.cross(center_of_mass_m - line, rotation[:, :, 0]), axis=1),
        pads=_pressed(plus.soft, minus.soft, width_m, off_m),
        unturned=_pressed(plus.unturned, minus.unturned, width_m, off_m),
    )


def _pressed(plus: _Touched, minus: _Touched, width_m: np.ndarray, off_m: np.ndarray) -> PressedPads:
    return PressedPads(
        middle_m=np.column_stack([off_m, (plus.center_m + minus.center_m) / 2]),
        width_m=width_m,
        least_apart_m=plus.least_m - minus.most_m,
        most_apart_m=plus.most_m - minus.least_m,
        touching=np.minimum(plus.cells, minus.cells) / PAD_CELLS,
    )


@dataclass(frozen=True)
class FilteredGrasps:
    """The indices of the grasps that are left with their contacts, and how many were left after the pads alone."""

    index: np.ndarray
    contacts: PadContacts
    after_pad: int


class GraspFilter:
    """The filters of one gripper for one object."""

    def __init__(
        self, gripper: ParallelGripper, hulls: tuple[np.ndarray, ...], center_of_mass_m: np.ndarray, friction: float
    ):
        """Prepare the convex hulls (each ``(V, 3)`` m); ``friction`` is that between finger and object."""
        self._gripper, self._center_of_mass_m = gripper, center_of_mass_m
        self._caster = RayCaster.of_hulls(hulls)
        self._collision = HandCollision(hulls)
        self._min_alignment = 1 / np.hypot(1, friction / CONE_SAFETY)

    def __call__(self, gripper_to_object: np.ndarray) -> FilteredGrasps:
        """Keep the grasps ``(N, 4, 4)`` whose pads would touch well and whose open hand is free of the object."""
        gripper = self._gripper
        plus = _pad_hits(gripper, gripper_to_object, self._caster, 1)
        met = np.flatnonzero((plus.soft.cells >= MIN_CELLS) & (plus.alignment >= self._min_alignment))
        minus = _pad_hits(
            gripper, gripper_to_object[met], self._caster, -1
        )  # half of all rays, where one pad is enough to tell
        contacts = _both_pads(gripper, gripper_to_object[met], plus.take(met), minus, self._center_of_mass_m)
        touching = (contacts.width_m < gripper.opening_m) & (contacts.cells >= MIN_CELLS)
        facing = (contacts.offset_m <= MAX_OFFSET_M) & (contacts.alignment >= self._min_alignment)
        both = np.flatnonzero(touching & facing)
        overlaps = self._collision.overlaps(
            gripper, gripper_to_object[met[both]], opening_m=gripper.opening_m, clearance_m=CLEARANCE_M
        )
        left = both[~overlaps]
        return FilteredGrasps(met[left], contacts.take(left), len(both))


def pad_merits(contacts: PadContacts, load_share: np.ndarray, jammed: np.ndarray) -> Merits:
    """Rate grasps: fit ones touch with three cells or more and bear twice what is asked of them; levers and loads cost.

    ``jammed (N,)`` are those that stay on the pads' edges and are not borne by them: they are weak.
    """
    weak = (contacts.cells < GOOD_CELLS) | jammed
    cost = np.hypot(contacts.lever_m / POOR_LEVER_M, load_share / GOOD_LOAD_SHARE)
    return Merits(~weak & (load_share <= GOOD_LOAD_SHARE), weak, cost, GOOD_COST)


def lowest_points_m(gripper: ParallelGripper, gripper_to_object: np.ndarray, object_to_plane: np.ndarray) -> np.ndarray:
    """Return the least height ``(N,)`` of the wide open hand above the plane z = 0, for each pose ``(N, 4, 4)``."""
    corners = np.concatenate([box_corners(half_m, pose) for pose, half_m in gripper.boxes(gripper.opening_m)])
    upwards = object_to_plane[2, :3]
    along = np.einsum("i,nij->nj", upwards, gripper_to_object[:, :3, :3])
    origins = gripper_to_object[:, :3, 3] @ upwards + object_to_plane[2, 3]
    return origins + (along @ corners.T).min(1)


def raised(
    gripper: ParallelGripper, gripper_to_object: np.ndarray, object_to_plane: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the grasps from above whose hand is below the plane, drawn back along their approach until it is clear.

    ``(N, 4, 4)`` to ``(M, 4, 4)``, with the index ``(M,)`` of each in the second value. Not drawn back farther than the pads
    are high: then nothing would be left between them.
    """
    missing_m = SUPPORT_CLEARANCE_M - lowest_points_m(gripper, gripper_to_object, object_to_plane)
    descent = -(gripper_to_object[:, :3, 2] @ object_to_plane[2, :3])
    back_m = missing_m / np.maximum(descent, MIN_DESCENT)
    index = np.flatnonzero((missing_m > 0) & (descent >= MIN_DESCENT) & (back_m < 2 * gripper.pad_half_extents_m[1]))
    poses = gripper_to_object[index].copy()
    poses[:, :3, 3] -= back_m[index, None] * poses[:, :3, 2]
    return poses, index
