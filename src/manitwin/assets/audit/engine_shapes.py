"""Collision shapes as an engine builds them from an asset's meshes: one hull, a hull for each group, or the triangles."""

from __future__ import annotations

from dataclasses import replace

from manitwin.assets.asset import Asset, CollisionShape
from manitwin.assets.audit.convex_shapes import ConvexShapes

ONE_HULL = ("mujoco", "sapien", "physx")
"""Engines that build one hull from a mesh, whatever its groups: MuJoCo, and the URDF importers of SAPIEN and Isaac by default."""
A_HULL_EACH_GROUP = ("pybullet",)
"""Engines that build a hull from each group of an OBJ file: Bullet's URDF importer makes a compound of them."""
TRIANGLES = ("gazebo",)
"""Engines that collide with the triangles of a mesh."""
DRAWN_FORMATS = ("sdf",)
"""Formats of these engines: if no engine is named, their concave meshes count as triangles."""
OF_HULLS = ("COL003", "COL004", "COL005", "COL006", "COL007")
"""Rules on what convex hulls fill or leave open, which do not apply to triangles."""


def with_engine_shapes(asset: Asset, engine: str | None) -> Asset:
    """Return the asset with the collision shapes that an ``engine`` builds from it.

    Without an engine they are what the author intended: each group of an OBJ file is a shape, unless some group has no volume,
    as if groups were the faces of one solid.
    """
    if engine in ONE_HULL or not any(shape.groups for shape in asset.collision):
        return asset
    meant = engine is None
    return replace(asset, collision=tuple(each for shape in asset.collision for each in split_groups(shape, meant)))


def split_groups(shape: CollisionShape, meant: bool) -> list[CollisionShape]:
    """Return one shape for each group that has a volume.

    With ``meant``, return what the author intended: the shape stays whole if some group has no volume.
    """
    flat = set(ConvexShapes.from_vertices([vertices for vertices, _ in shape.groups]).flat)
    if not shape.groups or (meant and flat):
        return [shape]
    return [
        CollisionShape(f"{shape.name}_{number:02d}", vertices, faces, shape.convex, shape.file)
        for number, (vertices, faces) in enumerate(shape.groups)
        if number not in flat
    ]
