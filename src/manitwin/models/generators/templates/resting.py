"""Resting pose of long bent objects: supported at two points with the centre of mass between them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.models.generators.templates.template import Model, Vector


def pitch_to_rest(model: Model) -> Model:
    """Return a model that lies along X, tipped about Y into its resting pose on z = 0.

    A spoon laid on its bowl tips until the end of its handle touches the table.
    """
    pitch_rad = resting_pitch_rad(model.assembly.triangles_m())
    cosine, sine = np.cos(pitch_rad), np.sin(pitch_rad)
    rotation = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])

    def turned(vector: Vector) -> Vector:
        x, y, z = (rotation @ vector).tolist()
        return x, y, z

    points = [replace(p, position_m=turned(p.position_m), direction=turned(p.direction)) for p in model.points]
    return Model(model.assembly.turned(rotation), dict(model.slots), points, model.perforated).rest_on_ground()


def resting_pitch_rad(triangles_m: np.ndarray) -> float:
    """Return the smallest rotation about Y (from Z to X) that puts a solid on a hull edge below its centre of mass.

    ``triangles_m (F, 3, 3)`` are its closed, outward-oriented surface; the hull is the convex hull projected along Y.
    """
    volumes = np.linalg.det(triangles_m)
    center = (volumes[:, None] * triangles_m.sum(axis=1)).sum(axis=0) / (4 * volumes.sum())
    outline = triangles_m.reshape(-1, 3)[:, ::2]
    corners = outline[ConvexHull(outline).vertices]  # counter-clockwise: lower edges run towards +X
    edges = np.roll(corners, -1, axis=0) - corners
    share = ((center[::2] - corners) * edges).sum(axis=1) / (edges**2).sum(axis=1)
    carries = (edges[:, 0] > 0) & (share >= 0) & (share <= 1)
    pitches = np.arctan2(edges[carries, 1], edges[carries, 0])
    return float(pitches[np.abs(pitches).argmin()])
