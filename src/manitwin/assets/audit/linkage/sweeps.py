"""Sweep test of joints: how much of a moving part passes through its parent over the joint range.

Engines filter contacts between a part and its parent, so that a drawer with a reversed axis slides through the back of its
cabinet without any warning.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from manitwin.assets.audit.convex_shapes import ConvexShapes
from manitwin.assets.audit.linkage.linkage import SLIDES, TURNS, Linkage, MovingJoint, Part
from manitwin.geometry.poses import transform_points
from manitwin.geometry.sampling import sample_surface

SAMPLES = 120
"""Points on the surface of the moving part."""
_STEPS = 24
_MOST_STEP_RAD = math.radians(5)
GRAZES_M = 1e-3
"""Allowed overlap of surfaces that slide on each other; the parent part is shrunk by it."""
_HOUSED, _STAYS = 0.02, 0.15
"""Shares of a part's surface for a part in a bearing: the least that lies inside, and the most by which this may change."""
LEAST_TRAVEL = 0.25
"""Least travel of a joint relative to the part's longest side; a button travels less."""


@dataclass(frozen=True)
class JointSweep:
    """Effect of a joint on its child part, as shares of the surface of that part.

    ``crossing`` starts outside the parent part and passes through it. ``inside`` starts inside it, with ``least_inside`` and
    ``most_inside`` over all positions.
    """

    joint: MovingJoint
    crossing: float
    inside: float
    least_inside: float
    most_inside: float

    @property
    def is_enclosed(self) -> bool:
        """Whether a nearly constant share stays inside over the joint range: a wheel in its fork, a shaft in its bearing."""
        return self.least_inside > _HOUSED and self.most_inside - self.least_inside < _STAYS


def sweep_joints(linkage: Linkage) -> list[JointSweep]:
    """Move every revolute or prismatic joint from its start to both limits, with the others fixed."""
    return [
        found
        for joint in linkage.joints
        if joint.kind in TURNS + SLIDES
        and (found := _sweep_joint(joint, linkage.parts[joint.parent], linkage.parts[joint.child])) is not None
    ]


def _sweep_joint(joint: MovingJoint, holder: Part, moved: Part) -> JointSweep | None:
    ends = _ends(joint)
    if not ends or not holder.shapes or not moved.shapes:
        return None
    points = _surface_points(moved.shapes)
    longest_m = float(np.ptp(np.concatenate(moved.shapes), axis=0).max())
    shapes = ConvexShapes.from_vertices(holder.shapes)
    within = _shrunk(shapes, min(GRAZES_M, 0.01 * longest_m))
    inside = within.depth_outside(points) <= 0
    crosses = np.zeros(len(points), bool)
    shares, travel_m = [float(inside.mean())], 0.0
    for end in ends:
        path = [points]
        for by in _positions(joint, end):
            path.append(transform_points(joint.displacement(by), points))
            shares.append(float((within.depth_outside(path[-1]) <= 0).mean()))
        travel_m = max(travel_m, max(float(np.linalg.norm(at - points, axis=1).max()) for at in path))
        crosses |= _crossing(within, path)
    if travel_m < LEAST_TRAVEL * longest_m:
        return None
    return JointSweep(joint, float((crosses & ~inside).mean()), shares[0], min(shares), max(shares))


def _ends(joint: MovingJoint) -> list[float]:
    """Return the joint travel from the start to the upper and to the lower limit, in rad or m, without zeros."""
    if joint.lower is None or joint.upper is None:
        return [math.pi, -math.pi] if joint.kind not in SLIDES else []
    ways = [joint.upper - joint.start, joint.lower - joint.start]
    if joint.kind not in SLIDES:
        ways = [float(np.clip(way, -2 * math.pi, 2 * math.pi)) for way in ways]
    return [way for way in ways if way]


def _positions(joint: MovingJoint, end: float) -> np.ndarray:
    steps = _STEPS if joint.kind in SLIDES else max(_STEPS, math.ceil(abs(end) / _MOST_STEP_RAD))
    return np.linspace(0, end, steps + 1)[1:]


def _surface_points(shapes: Sequence[np.ndarray]) -> np.ndarray:
    """Return points ``(N, 3)`` on the hulls of shapes, uniform by area and deterministic."""
    hulls = [ConvexHull(shape) for shape in shapes]
    vertices, faces = trimesh.util.append_faces([hull.points for hull in hulls], [hull.simplices for hull in hulls])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return np.asarray(sample_surface(mesh, SAMPLES, np.random.default_rng(0))[0])


def _shrunk(shapes: ConvexShapes, by_m: float) -> ConvexShapes:
    """Return shapes with their planes moved inward by ``by_m``."""
    planes = shapes.planes.copy()
    planes[:, 3] += by_m
    return ConvexShapes(
        planes,
        shapes.starts,
        shapes.triangles,
        shapes.volumes_m3,
        shapes.interior,
        shapes.boxes,
        shapes.flat,
        shapes.kept,
    )


def _crossing(within: ConvexShapes, path: Sequence[np.ndarray]) -> np.ndarray:
    """Return which points ``(N,)`` of a path pass through a shape."""
    crosses = np.zeros(len(path[0]), bool)
    low, high = within.boxes[:, 0].min(0), within.boxes[:, 1].max(0)
    for start, end in itertools.pairwise(path):
        near = ((np.minimum(start, end) <= high) & (np.maximum(start, end) >= low)).all(1) & ~crosses
        length = np.linalg.norm(end - start, axis=1)
        chosen = np.flatnonzero(near & (length > 0))
        if len(chosen):
            directions = (end - start)[chosen] / length[chosen, None]
            enter, leave = within.line_intervals(start[chosen], directions)
            overlap = np.minimum(leave, length[chosen, None]) - np.maximum(enter, 0)
            crosses[chosen] = (overlap > 0).any(1)
    return crosses
