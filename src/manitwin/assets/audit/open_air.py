"""Free space around and in an object, and the hollow into which something can be put."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from manitwin.geometry.ray_caster import MILLIMETRES

AIR_SAMPLES = 1500
_AXES = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])

# Measured by geometry.cavity: the smallest vessel (a shoe) holds 5.4 % of its hull, the largest sideways hollow that is not a
# vessel (the jaws of a clamp) 5.2 %.
_LEAST_SHARE_UP = 0.05
_LEAST_SHARE_SIDEWAYS = 0.10


@dataclass(frozen=True)
class FreeSpace:
    """Points in an object's bounding box from which at least one axis direction leads outside.

    ``points_m (N, 3)``; ``hollow (N,)`` marks those in the largest hollow, which the object closes on all sides but
    ``opens (3,)``; None if there is no such hollow. Points that see a wall in every direction count as matter.
    """

    points_m: np.ndarray
    hollow: np.ndarray
    opens: np.ndarray | None


def sample_free_space(mesh: trimesh.Trimesh, up: np.ndarray, hull_volume_m3: float) -> FreeSpace:
    """Cast rays along the six axis directions from random points in a mesh's bounding box; ``up (3,)`` is an axis.

    This works on meshes with seams and on walls without thickness. A hollow that only opens downward is ignored, because scans
    often lack their bottom.
    """
    low, high = mesh.bounds
    points = low + (high - low) * np.random.default_rng(0).random((AIR_SAMPLES, 3))
    escapes = _escapes(mesh, points)
    outside = escapes.any(1)
    points, escapes = points[outside], escapes[outside]
    pit = escapes.sum(1) == 1
    point_m3 = float(np.prod(high - low)) / AIR_SAMPLES
    best, share = None, 0.0
    for index, axis in enumerate(_AXES):
        if float(axis @ up) < -0.5:
            continue
        held = float((pit & escapes[:, index]).sum()) * point_m3 / hull_volume_m3 if hull_volume_m3 > 0 else 0.0
        upward = float(axis @ up) > 0.5
        least = _LEAST_SHARE_UP if upward else _LEAST_SHARE_SIDEWAYS
        deep = upward or _is_deep(points[pit & escapes[:, index]], axis)
        if held >= least and held > share and deep:
            best, share = index, held
    if best is None:
        return FreeSpace(points, np.zeros(len(points), dtype=bool), None)
    return FreeSpace(points, pit & escapes[:, best], _AXES[best])


def _is_deep(hollow: np.ndarray, axis: np.ndarray) -> bool:
    """Return whether points ``(N, 3)`` are at least half as deep along an axis as wide: a picture frame holds nothing."""
    if not len(hollow):
        return False
    sides = np.ptp(hollow, axis=0)
    along = np.abs(axis) > 0.5
    return bool(sides[along][0] >= 0.5 * sides[~along].min())


def _escapes(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Return for points ``(N, 3)`` which of the six axis directions lead outside, ``(N, 6) bool``.

    Uses the indexed mesh, unlike ``RayCaster``, because building the tree is most of the cost.
    """
    scene = EmbreeScene()
    vertices = (np.asarray(mesh.vertices) * MILLIMETRES).astype(np.float32)
    surface = TriangleMesh(scene, vertices, np.asarray(mesh.faces).astype(np.int32))
    origins = np.repeat((points * MILLIMETRES).astype(np.float32), len(_AXES), axis=0)
    hits = scene.run(origins, np.tile(_AXES.astype(np.float32), (len(points), 1)))
    del surface  # the scene refers to it, but does not keep it alive
    return np.asarray(hits < 0).reshape(len(points), len(_AXES))
