"""Where the two finger pads would touch the collision hulls: a grid of rays from each open pad, inwards."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from manitwin.geometry.ray_caster import RayCaster
from manitwin.robots.grippers.parallel import ParallelGripper

ACROSS, ALONG = 3, 5  # cells of a pad
INSET = 0.87  # the outermost rays lie inside the pad's edge
SAME_CONTACT_M = 0.0015  # cells this close behind the first one touch too, as soft pads do


@dataclass(frozen=True)
class PadContacts:
    """What the pads of N grasps meet.

    ``width_m`` distance of the two contacts along the closing axis (inf where a pad meets nothing), ``cells`` the
    smaller number of touching cells of the two pads, ``offset_m`` the distance of the two contacts' centres across the
    closing axis, ``alignment`` the smaller mean cosine of surface normal and closing axis, ``lever_m`` the distance of
    the centre of mass from the line through the contacts.
    """

    width_m: np.ndarray
    cells: np.ndarray
    offset_m: np.ndarray
    alignment: np.ndarray
    lever_m: np.ndarray

    def take(self, index: np.ndarray) -> PadContacts:
        """Return the contacts at ``index``."""
        return PadContacts(**{f.name: getattr(self, f.name)[index] for f in fields(self)})

    @staticmethod
    def joined(parts: list[PadContacts]) -> PadContacts:
        """Return the contacts of all parts, one after the other."""
        return PadContacts(**{f.name: np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(PadContacts)})


def pad_contacts(
    gripper: ParallelGripper, gripper_to_object: np.ndarray, hulls: RayCaster, center_of_mass_m: np.ndarray
) -> PadContacts:
    """Cast rays from both open pads of grasps ``(N, 4, 4)`` against the union of the hulls."""
    half_y, half_z = gripper.pad_half_extents_m
    y, z = np.meshgrid(
        np.linspace(-INSET * half_y, INSET * half_y, ACROSS),
        np.linspace(-INSET * half_z, INSET * half_z, ALONG) + gripper.tip_depth_m,
        indexing="ij",
    )
    grid = np.stack([y.ravel(), z.ravel()], axis=1)
    rotation, origin = gripper_to_object[:, :3, :3], gripper_to_object[:, :3, 3]
    depth, facing = [], []
    for side in (1, -1):
        pads = np.column_stack([np.full(len(grid), side * gripper.opening_m / 2), grid])
        starts = np.einsum("nij,kj->nki", rotation, pads) + origin[:, None]
        inwards = np.repeat(-side * rotation[:, None, :, 0], len(grid), axis=1)
        distance, face = hulls.first_hits(starts.reshape(-1, 3), inwards.reshape(-1, 3))
        cosine = np.where(face >= 0, -(hulls.face_normals[face] * inwards.reshape(-1, 3)).sum(1), 0.0)
        depth.append(distance.reshape(-1, len(grid)))
        facing.append(cosine.reshape(-1, len(grid)))
    first = [d.min(1) for d in depth]
    touching = [(d <= f[:, None] + SAME_CONTACT_M) & np.isfinite(d) for d, f in zip(depth, first, strict=True)]
    count = [t.sum(1) for t in touching]
    centers = [t @ grid / np.maximum(c, 1)[:, None] for t, c in zip(touching, count, strict=True)]
    alignment = [(t * f).sum(1) / np.maximum(c, 1) for t, f, c in zip(touching, facing, count, strict=True)]
    line = np.einsum("nij,nj->ni", rotation[:, :, 1:], (centers[0] + centers[1]) / 2) + origin
    return PadContacts(
        width_m=np.where(np.isfinite(first[0] + first[1]), gripper.opening_m - first[0] - first[1], np.inf),
        cells=np.minimum(*count),
        offset_m=np.linalg.norm(centers[0] - centers[1], axis=1),
        alignment=np.minimum(*alignment),
        lever_m=np.linalg.norm(np.cross(center_of_mass_m - line, rotation[:, :, 0]), axis=1),
    )
