"""Reading of the parts and joints of a whole URDF, SDF or MJCF file in its pose at loading."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np

from manitwin.assets.asset import CollisionShape, Format
from manitwin.assets.asset_files import AssetFiles
from manitwin.assets.audit.convex_shapes import ConvexShapes
from manitwin.assets.audit.engine_shapes import split_groups
from manitwin.assets.audit.linkage.linkage import Linkage, MovingJoint, Part
from manitwin.errors import AssetError

_READERS: dict[Format, str] = {"urdf": "urdf", "embodiedgen": "urdf", "sdf": "sdf", "mjcf": "mjcf"}
_NO_LENGTH = 1e-9
_FILLS_ITS_HULL = 0.95
MOST_PARTS = 200


def read_linkage(path: Path, format: Format, root: Path | None = None) -> Linkage | None:
    """Read the parts and joints of an asset; None for other formats, and for static models.

    Raises AssetError for an unreadable asset, one that lacks the mesh of a part, or one with more than ``MOST_PARTS`` parts.
    """
    if format not in _READERS:
        return None
    linkage: Linkage | None = import_module(f"{__package__}.{_READERS[format]}").read(path, root)
    if linkage is not None and len(linkage.parts) > MOST_PARTS:
        raise AssetError(
            f"{path.name}: {len(linkage.parts)} parts that move, more than the {MOST_PARTS} that are compared"
        )
    return linkage


def require_no_missing_mesh(files: AssetFiles, name: str) -> None:
    """Raise AssetError if a mesh is missing, because the remaining parts are not representative."""
    if files.has_missing_mesh:
        raise AssetError(f"{name}: meshes of its parts are missing: {', '.join(files.missing[:3])}")


def part_of(name: str, shapes: Sequence[CollisionShape], *, convex_only: bool = False) -> Part:
    """Return a part from collision shapes; the groups of an OBJ file are separate shapes if all of them are solids.

    ``convex_only``: leave out concave meshes, for engines that collide with triangles.
    """
    pieces = [piece for shape in shapes for piece in split_groups(shape, True)]
    hulls = ConvexShapes.from_vertices([np.asarray(piece.vertices, float) for piece in pieces])
    kept = zip(hulls.kept, hulls.volumes_m3, strict=True)
    chosen = [index for index, volume in kept if not convex_only or _is_convex(pieces[index], float(volume))]
    return Part(name, tuple(np.asarray(pieces[index].vertices, float) for index in chosen))


def moving_joint(
    name: str,
    kind: str,
    ends: tuple[int, int],
    joint_to_asset: np.ndarray,
    axis: np.ndarray | None,
    limits: tuple[float | None, float | None],
) -> MovingJoint:
    """Return a joint at the position within its limits closest to zero.

    Invalid limits count as absent. A joint whose axis has no direction becomes ``fixed``, as it cannot move.
    """
    along = np.array([1.0, 0, 0]) if axis is None else np.asarray(axis, float)
    length = float(np.linalg.norm(along))
    if not length > _NO_LENGTH:
        kind, along, length = "fixed", np.array([1.0, 0, 0]), 1.0
    lower, upper = limits
    if lower is None or upper is None or kind == "continuous" or not -np.inf < lower <= upper < np.inf:
        lower, upper = None, None
    start = 0.0 if lower is None or upper is None else float(np.clip(0.0, lower, upper))
    turned = joint_to_asset[:3, :3] @ (along / length)
    return MovingJoint(name, kind, *ends, joint_to_asset[:3, 3], turned, start, lower, upper)


def _is_convex(shape: CollisionShape, hull_m3: float) -> bool:
    corners = (np.asarray(shape.vertices, float) - np.mean(shape.vertices, axis=0))[shape.faces]
    volume_m3 = float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) / 6
    return shape.primitive or abs(volume_m3) > _FILLS_ITS_HULL * hull_m3
