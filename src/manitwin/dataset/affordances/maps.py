"""All that is known of a twin's surface at some points: parts, and maps of holding and of use."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.dataset.affordances.heat_maps import (
    FUNCTION_SHARE,
    LEAST_COSINE,
    RIM_SHARE,
    contact_density,
    contact_points,
    contact_spread_m,
    function_map,
    halves_agreement,
    surface_distances,
)
from manitwin.dataset.affordances.sampled_grasps import sample_grasps
from manitwin.geometry.frames.words import means_place
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.graspers.protocol import GraspProposals
from manitwin.pipeline.refinement import away_from_feature_m
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import NO_PART
from manitwin.twin.point_records import FunctionalPoint

POOL = 4
"""So many samples a point that is kept: the kept ones then lie evenly."""
LEAST_CONTACTS = 8
"""Fewer make no map."""


@dataclass(frozen=True)
class SurfaceMaps:
    """A twin's surface at points: ``points_m (N, 3)``, ``normals (N, 3)``, the face and the part of each (255: none).

    ``maps`` are by name, ``(N,)`` in [0, 1]: ``grasp``, ``task_grasp:<scenario's point>``, ``function:<point> <label>``.
    ``agreement``: of the maps of contacts, by name, how far two halves of their grasps agree, as SIM and AUC; only of those that
    have enough.
    """

    twin: Twin
    points_m: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    parts: np.ndarray
    maps: dict[str, np.ndarray]
    tried: int
    held: int
    agreement: dict[str, tuple[float, float]]


def surface_maps(twin: Twin, *, points: int, trials: int, seed: int, grippers: Sequence[Gripper] = ()) -> SurfaceMaps:
    """Compute the maps of a twin; without enough contacts there is no map ``grasp``. The same arguments give the same maps.

    ``grippers`` are those of one's own that twins were built with. Raises TwinError for a twin that was rejected, UsageError for
    one without a gripper of parallel jaws that is known.
    """
    rng = np.random.default_rng([seed, zlib.crc32(twin.record.twin_id.encode())])
    vertices, faces = trimesh.util.append_faces(
        [part.vertices for part in twin.visual], [part.faces for part in twin.visual]
    )
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    pool, normals, face = sample_surface(mesh, POOL * points, rng)
    kept = farthest_point_sampling(pool, points)
    pool, normals, face = pool[kept], normals[kept], face[kept]
    caster, spread_m = RayCaster(mesh), contact_spread_m(mesh.extents)
    solid = mesh.copy()
    solid.merge_vertices(merge_tex=True, merge_norm=True)
    sampled = sample_grasps(twin, solid, trials, rng, grippers)
    touches = {"grasp": _contacts(caster, sampled.grasps.take(np.flatnonzero(sampled.held)))}
    touches = {name: found for name, found in touches.items() if len(found[0]) >= 2 * LEAST_CONTACTS}
    touches |= _task_contacts(twin, caster, sampled.gripper)
    maps = {name: contact_density(pool, contacts, spread_m) for name, (contacts, _) in touches.items()}
    agreement = {
        name: _agreement(pool, contacts, of_grasp, spread_m, rng)
        for name, (contacts, of_grasp) in touches.items()
        if len(contacts) >= 2 * LEAST_CONTACTS
    }
    maps |= _functions(twin, pool, normals, mesh.extents)
    return SurfaceMaps(
        twin, pool, normals, face, twin.face_parts()[face], maps, len(sampled.held), int(sampled.held.sum()), agreement
    )


def _contacts(caster: RayCaster, grasps: GraspProposals) -> tuple[np.ndarray, np.ndarray]:
    return contact_points(caster, grasps.gripper_to_object, grasps.width_m, grasps.depth_m)


def _agreement(
    points_m: np.ndarray, contacts: np.ndarray, of_grasp: np.ndarray, spread_m: float, rng: np.random.Generator
) -> tuple[float, float]:
    half = (rng.permutation(int(of_grasp.max()) + 1) % 2 == 0)[of_grasp]
    return halves_agreement(points_m, contacts[half], contacts[~half], spread_m)


def _task_contacts(twin: Twin, caster: RayCaster, gripper: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return for each functional point that a gripper's verified grasps serve their contacts ``(C, 3)``, and each one's grasp."""
    grasps = twin.grasps(gripper=gripper)
    serves = np.array(grasps.columns["functional_point_id"], object)
    found = {}
    for point in twin.record.points.functional if twin.record.points else ():
        at = np.flatnonzero(serves == point.id)
        contacts, of_grasp = contact_points(
            caster, grasps.gripper_to_object[at], grasps.width_m[at], grasps.depth_m[at]
        )
        if len(contacts) >= LEAST_CONTACTS:
            found[f"task_grasp:{point.id} {point.label}"] = contacts, of_grasp
    return found


def _functions(twin: Twin, points_m: np.ndarray, normals: np.ndarray, extents_m: np.ndarray) -> dict[str, np.ndarray]:
    """Return a map for each functional point: how near it is along the surface, of an opening how near its rim is."""
    found = {}
    for point in twin.record.points.functional if twin.record.points else ():
        seeds = _seeds(point, points_m, normals)
        distance_m = surface_distances(points_m, normals, seeds).min(0)
        share = RIM_SHARE if _opens(point) else FUNCTION_SHARE
        found[f"function:{point.id} {point.label}"] = function_map(distance_m, extents_m, share)
    return found


def _seeds(point: FunctionalPoint, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the points from which the distance to a functional point counts: the nearest on its side of the matter.

    An opening is used all around: its points are those at the rim's circle, as near as neighbours are to each other.
    """
    same_side = normals @ np.array(point.normal) > LEAST_COSINE
    away_m = np.linalg.norm(points_m - np.array(point.position_m), axis=1)
    nearest = int(np.where(same_side, away_m, away_m + away_m.max()).argmin())
    if point.frame is None or not _opens(point):
        return np.array([nearest])
    spacing_m = float(np.median(cKDTree(points_m).query(points_m, 2)[0][:, 1]))
    return np.union1d(nearest, np.flatnonzero(away_from_feature_m(point.frame, points_m) <= 2 * spacing_m))


def _opens(point: FunctionalPoint) -> bool:
    """Whether a point means an opening whose rim is known."""
    return point.frame is not None and point.frame.kind == "opening" and means_place(point.label, "opening")


def has_parts(maps: SurfaceMaps) -> bool:
    """Tell whether any point is of a part that is known."""
    return bool((maps.parts != NO_PART).any())
