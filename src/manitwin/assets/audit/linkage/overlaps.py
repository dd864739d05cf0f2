"""Penetration depths of parts at loading, for formats that state no collision filter."""

from __future__ import annotations

from itertools import combinations

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from manitwin.assets.audit.linkage.linkage import Linkage, Overlap


def find_overlaps(linkage: Linkage) -> tuple[Overlap, ...]:
    """Return the initial overlaps of parts that are not connected by a joint; engines filter the contacts of connected ones.

    For MJCF they are those that MuJoCo found. Otherwise the depth is the penetration depth of the deepest pair of convex shapes
    (MuJoCo's ``mj_geomDistance``, by GJK and EPA).
    """
    if linkage.overlaps is not None:
        return linkage.overlaps
    if not linkage.collide:
        return ()
    joined = {frozenset((joint.parent, joint.child)) for joint in linkage.joints}
    shapes = [(part, shape) for part, each in enumerate(linkage.parts) for shape in each.shapes]
    boxes = [(shape.min(0), shape.max(0)) for _, shape in shapes]
    near = [
        (i, j)
        for i, j in combinations(range(len(shapes)), 2)
        if shapes[i][0] != shapes[j][0]
        and frozenset((shapes[i][0], shapes[j][0])) not in joined
        and bool((boxes[i][0] < boxes[j][1]).all() and (boxes[j][0] < boxes[i][1]).all())
    ]
    if not near:
        return ()
    depths = _depths([shape for _, shape in shapes], near)
    deepest: dict[tuple[int, int], float] = {}
    for (i, j), depth in zip(near, depths, strict=True):
        pair = (shapes[i][0], shapes[j][0])
        deepest[pair] = max(deepest.get(pair, 0.0), depth)
    names = [part.name for part in linkage.parts]
    return tuple(Overlap(names[one], names[other], depth) for (one, other), depth in deepest.items() if depth > 0)


def _depths(shapes: list[np.ndarray], pairs: list[tuple[int, int]]) -> list[float]:
    """Return the penetration depth (m) of the hulls of pairs of shapes, 0 if they are separate."""
    spec = mujoco.MjSpec()
    used = sorted({index for pair in pairs for index in pair})
    for index in used:
        hull = ConvexHull(shapes[index])
        places = {int(vertex): place for place, vertex in enumerate(hull.vertices)}
        faces = [places[int(vertex)] for simplex in hull.simplices for vertex in simplex]
        mesh = spec.add_mesh(name=f"shape_{index}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        mesh.uservert, mesh.userface = shapes[index][hull.vertices].reshape(-1), np.array(faces, np.int32)
        spec.worldbody.add_geom(name=f"shape_{index}", type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"shape_{index}")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = {index: place for place, index in enumerate(used)}
    return [max(0.0, -mujoco.mj_geomDistance(model, data, geoms[i], geoms[j], 0.0, None)) for i, j in pairs]
