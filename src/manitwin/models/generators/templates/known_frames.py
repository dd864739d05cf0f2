"""Frames of a template's known points: position and Z by construction, size and X from the geometry of its parts."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.frames.feature import UP, rotation_of
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.templates.template import KnownPoint
from manitwin.models.generators.templates.template_object import TemplateObject
from manitwin.twin.point_records import FunctionalFrame

_TURNS = 48
_BELOW_RIM_SHARE = 0.1  # of the distance to the nearest wall: depth of rays below the rim plane
_FACING = np.cos(np.radians(25))
_END_SHARE = 0.012  # of the longest side
_ROUND = 1.15  # maximum ratio of farthest to nearest wall of a round rim
_HANDLES, _SPOUTS = ("handle", "grips"), ("spout",)


def known_frame(made: TemplateObject, point: KnownPoint, center_of_mass_m: np.ndarray) -> FunctionalFrame:
    """Return the frame of a known point in the object frame.

    Position and Z are those of the template; for a face, the position is its centre. X and the size follow from the faces of the
    part. X points away from the handle or towards the spout for an opening, along an edge, and towards the centre of mass
    ``(3,)`` for a hole.
    """
    position, z = np.array(point.position_m), np.array(point.direction) / np.linalg.norm(point.direction)
    x, size, free = _extent(made, point, position, z, center_of_mass_m)
    if point.kind == "face":
        position = _face_center(made, point, position, z)
    return FunctionalFrame(
        position_m=position.tolist(),
        quaternion_wxyz=quaternion_wxyz(rotation_of(z, x)).tolist(),
        kind=point.kind,
        size_m=max(size, 1e-4),
        free="roll" if free else "none",
        source=f"template:{made.category}",
    )


def _extent(
    made: TemplateObject, point: KnownPoint, position: np.ndarray, z: np.ndarray, center_of_mass_m: np.ndarray
) -> tuple[np.ndarray, float, bool]:
    """Return the X direction, the size, and whether the roll about Z is free."""
    longest = float(np.ptp(made.mesh.vertices, axis=0).max())
    if point.kind in ("opening", "hole"):
        walls = _walls_m(made, position, z)
        if point.kind == "hole":
            return center_of_mass_m - position, float(walls.min()), False
        x = _pour_direction(made, position, z)
        is_round = float(np.quantile(walls, 0.95)) < _ROUND * float(np.quantile(walls, 0.05))
        return (x if x is not None else _along(walls, z)), float(np.sqrt(np.mean(walls**2))), x is None and is_round
    corners = made.mesh.vertices[made.mesh.faces[made.mesh.faces_of(point.part)]]
    if point.kind == "edge":
        flat = corners.reshape(-1, 3) - position
        flat = flat[flat @ z > -0.1 * longest]
        flat = flat - (flat @ z)[:, None] * z
        along = np.linalg.eigh(flat.T @ flat)[1][:, 2]
        return along, float(np.ptp(flat @ along)), False
    if point.kind == "tip":
        end = corners.reshape(-1, 3) - position
        end = end[np.abs(end @ z) < _END_SHARE * longest]
        across = np.linalg.norm(end - (end @ z)[:, None] * z, axis=1)
        return UP, float(across.max()) if len(across) else 0.0, True
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    areas = np.linalg.norm(cross, axis=1)
    facing = cross @ z > _FACING * areas
    return UP, float(np.sqrt(areas[facing].sum() / np.pi)), True


def _face_center(made: TemplateObject, point: KnownPoint, position: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the centre of the part's faces that lie in the plane of ``position`` and face along ``z``."""
    corners = made.mesh.vertices[made.mesh.faces[made.mesh.faces_of(point.part)]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    areas, centers = np.linalg.norm(cross, axis=1), corners.mean(1)
    longest = float(np.ptp(made.mesh.vertices, axis=0).max())
    facing = (cross @ z > _FACING * areas) & (np.abs((centers - position) @ z) < _END_SHARE * longest)
    return position if not facing.any() else np.asarray(areas[facing] @ centers[facing] / areas[facing].sum())


def _walls_m(made: TemplateObject, position: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Return the distances ``(48,)`` in metres to the walls around an opening or hole, just below its rim."""
    caster = RayCaster(trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False))
    basis = rotation_of(z)
    angle = np.arange(_TURNS) * 2 * np.pi / _TURNS
    out = np.cos(angle)[:, None] * basis[:, 0] + np.sin(angle)[:, None] * basis[:, 1]
    longest = float(np.ptp(made.mesh.vertices, axis=0).max())
    depth = 0.002 * longest
    for _ in range(2):
        origin = np.repeat((position - depth * z)[None], _TURNS, 0)
        distance = np.minimum(caster.first_hits(origin, out)[0], longest)
        depth = min(_BELOW_RIM_SHARE * float(distance.min()), 0.02 * longest)
    return np.asarray(distance)


def _along(walls: np.ndarray, z: np.ndarray) -> np.ndarray:
    basis = rotation_of(z)
    widths = walls[: _TURNS // 2] + walls[_TURNS // 2 :]
    turn = int(widths.argmax()) * 2 * np.pi / _TURNS
    return np.asarray(np.cos(turn) * basis[:, 0] + np.sin(turn) * basis[:, 1])


def _pour_direction(made: TemplateObject, position: np.ndarray, z: np.ndarray) -> np.ndarray | None:
    for names, sign in ((_SPOUTS, 1.0), (_HANDLES, -1.0)):
        for name in names:
            if name in made.mesh.names:
                corners = made.mesh.vertices[made.mesh.faces[made.mesh.faces_of(name)]].reshape(-1, 3) - position
                across = corners - (corners @ z)[:, None] * z
                mean = (across.min(0) + across.max(0)) / 2
                if np.linalg.norm(mean) > 0.25 * float(np.linalg.norm(across, axis=1).max()):
                    return np.asarray(sign * mean)
                spread = np.linalg.eigh(across.T @ across)[1][:, 2]  # two opposite handles: X is between them
                return np.asarray(np.cross(z, spread))
    return None
