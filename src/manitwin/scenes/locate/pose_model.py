"""Precomputed model of a twin for pose search: surface points, visible points by direction, ray caster, symmetries."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import trimesh
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.sampling import sample_surface
from manitwin.geometry.symmetry import Symmetries, find_symmetries
from manitwin.render.raycast import merge_parts
from manitwin.scenes.locate.registration import Surface, align
from manitwin.twin.loaded_twin import Twin

SURFACE_POINTS = 6000
SHOWN_TRIED, SHOWN_KEPT = 900, 160
ROUND_STEPS = 36
"""Discretized rotations about the axis of a body of revolution: every 10 degrees."""
OWN_TURNS_DEG = np.arange(10, 360, 10)
"""Rotations to escape local optima of alignment, such as a handle on the wrong side."""
_SELF_POINTS = 200
_AWAY = 2.0
"""Distance in diameters from which visibility is tested."""


@dataclass(frozen=True)
class PoseModel:
    """A twin's surface in the object frame, m.

    ``sides (V, 3)`` are viewing directions from the object, and ``shown[v] (S, 3)`` the points visible from each;
    ``center (3,)`` is the centre of the bounding box. ``near_motions (T, 4, 4)`` are motions that map much of the surface onto
    itself, such as a rotation of a mug about the axis of its body.
    """

    twin_id: str
    caster: RayCaster
    surface: Surface
    center: np.ndarray
    sides: np.ndarray
    shown: tuple[np.ndarray, ...]
    shown_trees: tuple[cKDTree, ...]
    symmetries: Symmetries
    near_motions: np.ndarray

    @classmethod
    def of_twin(cls, twin: Twin) -> PoseModel:
        """Prepare a twin; raises TwinError."""
        return cls.of_mesh(twin.record.twin_id, merge_parts(twin.visual))

    @classmethod
    def of_mesh(cls, twin_id: str, mesh: trimesh.Trimesh) -> PoseModel:
        """Prepare a surface in the object frame, deterministically."""
        rng = np.random.default_rng(0)
        points, normals, _ = sample_surface(mesh, SURFACE_POINTS, rng)
        caster = RayCaster(mesh)
        corners = trimesh.convex.convex_hull(mesh.vertices).vertices
        diameter_m = float(pdist(corners).max())
        sides = np.asarray(trimesh.creation.icosphere(subdivisions=1).vertices)
        shown = tuple(_shown_from(side, points, caster, diameter_m, rng) for side in sides)
        surface = Surface(points, normals, cKDTree(points), diameter_m)
        center = np.asarray((corners.min(0) + corners.max(0)) / 2)
        return cls(
            twin_id=twin_id,
            caster=caster,
            surface=surface,
            center=center,
            near_motions=_near_motions(surface, center),
            sides=sides,
            shown=shown,
            shown_trees=tuple(cKDTree(each) for each in shown),
            symmetries=find_symmetries(mesh, np.random.default_rng(0)),
        )

    def scaled(self, factor: float) -> PoseModel:
        """Return the model scaled about the origin of the object frame."""
        points = self.surface.points * factor
        shown = tuple(each * factor for each in self.shown)
        motions = self.near_motions.copy()
        motions[:, :3, 3] *= factor
        return PoseModel(
            twin_id=self.twin_id,
            caster=self.caster.scaled(factor),
            surface=Surface(points, self.surface.normals, cKDTree(points), self.surface.diameter_m * factor),
            center=self.center * factor,
            sides=self.sides,
            shown=shown,
            shown_trees=tuple(cKDTree(each) for each in shown),
            symmetries=replace(self.symmetries, center_m=self.symmetries.center_m * factor),
            near_motions=motions,
        )

    @property
    def diameter_m(self) -> float:
        """The largest distance between two of its points."""
        return self.surface.diameter_m

    @property
    def points(self) -> np.ndarray:
        """The points ``(N, 3)`` of its surface."""
        return self.surface.points

    @cached_property
    def symmetry_poses(self) -> np.ndarray:
        """The rotational symmetries ``(S, 4, 4)`` of the shape in the object frame, identity first.

        For a body of revolution, they are discretized rotations about its axis, also combined with a rotation that swaps its
        ends; for a ball, combined with each rotation of a cube.
        """
        found = self.symmetries
        turns = [motion for motion in found.motions if np.linalg.det(motion) > 0]
        if found.axis is not None:
            axis = found.axis
            swaps = turns[1:] if found.ball else [motion for motion in turns if motion @ axis @ axis < 0][:1]
            steps = np.arange(ROUND_STEPS) * (2 * np.pi / ROUND_STEPS)
            about = [trimesh.transformations.rotation_matrix(float(angle), axis)[:3, :3] for angle in steps]
            turns = [each @ swap for swap in (np.eye(3), *swaps) for each in about]
        center = found.center_m
        return np.array([transform(turn, center - turn @ center) for turn in turns])


def _near_motions(surface: Surface, center: np.ndarray) -> np.ndarray:
    """Return rotations about the axes of the object frame, each aligned so that most of the surface falls on itself."""
    turns = np.array(
        [
            trimesh.transformations.rotation_matrix(np.deg2rad(angle), axis, center)
            for axis in np.eye(3)
            for angle in OWN_TURNS_DEG
        ]
    )
    few = surface.points[:: max(1, len(surface.points) // _SELF_POINTS)]
    return align(few, surface, turns, iterations=10, kept_share=0.6, facing=False)


def _shown_from(
    side: np.ndarray, points: np.ndarray, caster: RayCaster, diameter_m: float, rng: np.random.Generator
) -> np.ndarray:
    """Return a subset of surface points that are visible from far along ``side``."""
    tried = points[rng.choice(len(points), min(SHOWN_TRIED, len(points)), replace=False)]
    away = _AWAY * diameter_m
    hit, _ = caster.first_hits(tried + side * away, np.broadcast_to(-side, tried.shape))
    seen = tried[np.abs(hit - away) < 0.005 * diameter_m]
    return np.asarray(seen[:SHOWN_KEPT] if len(seen) else tried[:SHOWN_KEPT])
