"""Solids whose pose is told, and what a noisy depth camera sees of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.geometry.poses import inverse
from manitwin.render.cameras import Camera, look_at, pixel_rays
from manitwin.render.raycast import cast_camera
from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.locate.depth_view import DepthView, view_of_camera
from manitwin.scenes.locate.pose_model import PoseModel

BACKDROP_M = 1.5
OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Seen:
    """A noisy view, the mask of the thing in it, and its true pose."""

    view: DepthView
    mask: np.ndarray
    object_to_camera: np.ndarray


def block(extents: tuple[float, float, float], at: tuple[float, float, float]) -> trimesh.Trimesh:
    box = trimesh.creation.box(extents)
    box.apply_translation(at)
    return box


def stool() -> trimesh.Trimesh:
    """Return a body without any symmetry: three blocks of different sizes on each other."""
    parts = [
        block((0.12, 0.08, 0.04), (0, 0, 0.02)),
        block((0.04, 0.05, 0.07), (0.03, 0.01, 0.075)),
        block((0.05, 0.02, 0.02), (-0.03, -0.02, 0.05)),
    ]
    return trimesh.util.concatenate(parts)


def jar() -> trimesh.Trimesh:
    """Return a cylinder with one knob at azimuth 0."""
    body = trimesh.creation.cylinder(0.045, 0.11, sections=64)
    return trimesh.util.concatenate([body, block((0.02, 0.012, 0.03), (0.05, 0, 0.01))])


def seen_from(
    model: PoseModel, azimuth_rad: float, *, hidden_right: float = 0.0, noise: bool = True, table: bool = False
) -> Seen:
    """Look at a model from an azimuth, 0.8 m away, with noise; ``hidden_right``: the share that a board hides.

    It stands on a ``table``, or before a wall.
    """
    eye = model.center + 0.8 * np.array([0.9 * np.cos(azimuth_rad), 0.9 * np.sin(azimuth_rad), 0.43])
    camera = Camera(look_at(eye, model.center), 0.45, 240, 240)
    depth, _, _ = cast_camera(model.caster, camera)
    mask = depth > 0
    origins, rays = pixel_rays(camera)
    level = (model.points[:, 2].min() - origins[:, 2]) / rays[:, 2]
    behind = level.reshape(depth.shape) if table else np.full_like(depth, BACKDROP_M)
    depth = np.where(mask, depth, behind)
    if hidden_right:
        edge = np.quantile(np.nonzero(mask)[1], 1 - hidden_right)
        board = np.arange(240)[None] > edge
        depth = np.where(board, 0.6, depth)
        mask = mask & ~board
    told = DepthNoise().simulate_depth(depth, np.random.default_rng(1)) if noise else depth
    return Seen(view_of_camera(camera, told), mask, OPENGL_TO_OPENCV @ inverse(camera.camera_to_object))
