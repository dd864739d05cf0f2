"""Labels of a twin's surface points: parts, grasp maps and function maps."""

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
    split_half_agreement,
    surface_distances,
)
from manitwin.dataset.affordances.sampled_grasps import sample_grasps
from manitwin.geometry.frames.label_keywords import denotes_feature_itself
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import farthest_point_sampling, sample_surface
from manitwin.models.graspers.protocol import GraspProposals
from manitwin.pipeline.refinement import away_from_feature_m
from manitwin.robots.grippers.gripper import Gripper
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.part_records import NO_PART
from manitwin.twin.point_records import FunctionalPoint

POOL = 4
"""Oversampling factor; farthest point sampling then keeps an even subset."""
LEAST_CONTACTS = 8
"""Minimum number of contacts of a map."""


@dataclass(frozen=True)
class SurfaceMaps:
    """Surface points of a twin with ``points_m (N, 3)``, ``normals (N, 3)``, and the face and part of each (255: no part).

    ``maps`` has values ``(N,)`` in [0, 1] by name: ``grasp``, ``task_grasp:<functional point> <label>``, ``function:<functional
    point> <label>``. ``agreement`` has, for contact maps with enough contacts, the split-half agreement of their grasps as SIM
    and AUC. ``tried`` and ``held`` count the sampled grasps.
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
    """Compute the maps of a twin; the map ``grasp`` is missing if there are too few contacts. Equal arguments give equal maps.

    ``grippers`` are user-defined grippers that twins were built with. Raises TwinError for a rejected twin, and UsageError for
    one without a known parallel-jaw gripper.
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
    maps |= _function_maps(twin, pool, normals, mesh.extents)
    return SurfaceMaps(
        twin, pool, normals, face, twin.face_parts()[face], maps, len(sampled.held), int(sampled.held.sum()), agreement
    )


def _contacts(caster: RayCaster, grasps: GraspProposals) -> tuple[np.ndarray, np.ndarray]:
    return contact_points(caster, grasps.gripper_to_object, grasps.width_m, grasps.depth_m)


def _agreement(
    points_m: np.ndarray, contacts: np.ndarray, of_grasp: np.ndarray, spread_m: float, rng: np.random.Generator
) -> tuple[float, float]:
    half = (rng.permutation(int(of_grasp.max()) + 1) % 2 == 0)[of_grasp]
    return split_half_agreement(points_m, contacts[half], contacts[~half], spread_m)


def _task_contacts(twin: Twin, caster: RayCaster, gripper: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the contacts ``(C, 3)`` and their grasp indices for each functional point that verified grasps of a
    gripper serve.
    """
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


def _function_maps(
    twin: Twin, points_m: np.ndarray, normals: np.ndarray, extents_m: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the proximity map of each functional point; for an opening, the proximity to its rim."""
    found = {}
    for point in twin.record.points.functional if twin.record.points else ():
        seeds = _seed_indices(point, points_m, normals)
        distance_m = surface_distances(points_m, normals, seeds).min(0)
        share = RIM_SHARE if _is_opening(point) else FUNCTION_SHARE
        found[f"function:{point.id} {point.label}"] = function_map(distance_m, extents_m, share)
    return found


def _seed_indices(point: FunctionalPoint, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the points from which the distance to a functional point is measured: the nearest one on the same side of the
    surface.

    An opening is used around its whole rim: its seeds are the points near the rim circle, within twice the point spacing.
    """
    same_side = normals @ np.array(point.normal) > LEAST_COSINE
    away_m = np.linalg.norm(points_m - np.array(point.position_m), axis=1)
    nearest = int(np.where(same_side, away_m, away_m + away_m.max()).argmin())
    if point.frame is None or not _is_opening(point):
        return np.array([nearest])
    spacing_m = float(np.median(cKDTree(points_m).query(points_m, 2)[0][:, 1]))
    return np.union1d(nearest, np.flatnonzero(away_from_feature_m(point.frame, points_m) <= 2 * spacing_m))


def _is_opening(point: FunctionalPoint) -> bool:
    """Return whether a functional point denotes an opening with a known rim."""
    return point.frame is not None and point.frame.kind == "opening" and denotes_feature_itself(point.label, "opening")


def has_parts(maps: SurfaceMaps) -> bool:
    """Return whether any point has a known part."""
    return bool((maps.parts != NO_PART).any())
