"""Up axis of glTF meshes in URDF and SDF: some loaders turn them from Y up to Z up, and files exist for either convention."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh

from manitwin.assets.asset import CollisionShape
from manitwin.assets.asset_files import AssetFiles

Shapes = tuple[list[trimesh.Trimesh], list[CollisionShape]]
Y_UP_FORMATS = ("glb", "gltf")
_SAME_M = 1e-6


def upright_shapes(read: Callable[[bool], list[Shapes]], files: AssetFiles) -> list[Shapes]:
    """Return the visual parts and collision shapes of each link, with glTF meshes turned to Z up if that fits better.

    ``read(turn)`` reads them turned or as written. Drake and Gazebo turn them, as the format defines Y up; SAPIEN does not.
    Collision shapes that are not glTF show the convention of a file: the reading is chosen whose visual and collision boxes are
    closer, summed over the links. Without such shapes, meshes are turned. One box for a whole robot would depend only on the
    link that reaches farthest.
    """
    as_written = read(False)
    if not any(file.suffix.lower().lstrip(".") in Y_UP_FORMATS for file in files.used):
        return as_written
    turned = read(True)
    if sum(_box_distance_m(*link) for link in turned) > sum(_box_distance_m(*link) for link in as_written) + _SAME_M:
        return as_written
    files.remark("its glTF meshes were turned from Y up to Z up, as Drake and Gazebo do and SAPIEN does not")
    return turned


def concatenate_links(by_link: list[Shapes]) -> tuple[list[trimesh.Trimesh], list[CollisionShape], list[int]]:
    """Concatenate the visual parts and the collision shapes of all links; also return the link index of each visual part."""
    visual = [part for parts, _ in by_link for part in parts]
    collision = [shape for _, shapes in by_link for shape in shapes]
    return visual, collision, [number for number, (parts, _) in enumerate(by_link) for _ in parts]


def _box_distance_m(visual: list[trimesh.Trimesh], collision: list[CollisionShape]) -> float:
    """Return the largest distance (m) between sides of the visual and the collision box; 0 if either is empty."""
    seen = [np.asarray(part.vertices) for part in visual if len(part.vertices)]
    felt = [shape.vertices for shape in collision if len(shape.vertices)]
    if not seen or not felt:
        return 0.0
    boxes = [np.array([np.concatenate(each).min(0), np.concatenate(each).max(0)]) for each in (seen, felt)]
    return float(np.abs(boxes[0] - boxes[1]).max())
